"""Conic programs as data, and solvers for them: one interface, one binding each."""
