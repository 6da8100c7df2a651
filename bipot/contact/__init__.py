"""Contact: candidates and their rows, sampling over the surface, what is open, closed, shared or held."""
