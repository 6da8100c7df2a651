"""Helpers for all modules: definite matrices, files replaced at once, signals that wait."""
