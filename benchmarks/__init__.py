"""Time against the unit of cost kappa: ``python -m benchmarks.speed [--fast] [--out DIR]``.

What :mod:`studies` sets before numpy is imported, the number of threads and the end by Ctrl-C, holds here too.
"""

import studies  # noqa: F401
