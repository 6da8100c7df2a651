"""The fuzz study: scenes and problems drawn at random, marched, and judged by :mod:`studies.independent`."""
