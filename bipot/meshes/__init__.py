"""Meshes: cells, their elements and facets, makers of sections and solids, files."""
