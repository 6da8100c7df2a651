"""What any module may need of Python and of the machine: read-only arrays, memory, files put in place at once."""
