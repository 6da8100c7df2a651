"""Errors against the truth: of the mesh and of the increments."""
