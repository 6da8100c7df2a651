"""One script a question: ``python -m studies.NAME [--fast] [--out DIR]``. Studies write results only.

Thread counts are set here, before numpy is imported: the matrices are small and threads only contend.
"""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
