"""Helpers for all modules: read-only mappings, memory of the machine, files replaced at once."""
