"""Time against the unit of cost kappa: ``python -m benchmarks.speed [--fast] [--out DIR]``.

Thread counts are set here, before numpy is imported: the matrices are small and threads only contend.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
