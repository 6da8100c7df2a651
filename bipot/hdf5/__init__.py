"""Untrusted HDF5 files: their declarations are checked before anything is read."""
