"""Helpers for all modules: memory of the machine, definite matrices, files replaced at once, signals that wait."""
