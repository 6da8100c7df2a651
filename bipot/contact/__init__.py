"""Contact: candidates and their rows, sampling of the surface, and which contacts are open, closed, shared or held."""
