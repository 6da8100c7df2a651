"""Thread counts before numpy is imported (the matrices are small), one hypothesis profile, and what files share."""

import os
from collections import Counter

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
os.environ.setdefault("MPLBACKEND", "Agg")

import pytest  # noqa: E402
from hypothesis import settings  # noqa: E402

from tests.recording import complete, steps  # noqa: E402
from tests.thinned import THINNED  # noqa: E402

settings.register_profile("bipot", deadline=None, derandomize=True, max_examples=30)
settings.load_profile("bipot")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark as slow what :mod:`tests.thinned` leaves to `make check-long`."""
    seen = Counter()
    for item in items:
        every = THINNED.get(f"{item.path.stem}::{item.originalname}")
        if every is not None and not item.get_closest_marker("slow"):
            if seen[item.path, item.originalname] % every:
                item.add_marker("slow")
            seen[item.path, item.originalname] += 1


@pytest.fixture(scope="session")
def marched():
    """The increments of the short march of :mod:`tests.recording`."""
    return steps()


@pytest.fixture(scope="session")
def recorded(tmp_path_factory):
    """The folder of its complete run, which no test may change."""
    return complete(tmp_path_factory.mktemp("results") / "mu0.3")
