"""Conic programs as data, and the solvers that take them: one interface, one binding each."""
