"""An accepted increment judged by a recomputation from plain arrays, which imports nothing of the library."""
