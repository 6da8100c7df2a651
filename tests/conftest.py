"""Thread counts before numpy is imported (the matrices are small), and one hypothesis profile for all tests."""

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
os.environ.setdefault("MPLBACKEND", "Agg")

from hypothesis import settings  # noqa: E402

settings.register_profile("bipot", deadline=None, derandomize=True, max_examples=30)
settings.load_profile("bipot")
