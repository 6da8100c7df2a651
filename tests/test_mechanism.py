"""When a motion proves that a load is above the limit: each condition by itself, just met and just missed."""

import numpy as np
import pytest

from bipot.programs.limit import Mechanism


def proves(**changes):
    """The claim of a motion that passes, but for these changes."""
    given = {"volume": 0.0, "carried": 0.9, "overtaken": 0.0, "share": 1.0}
    return Mechanism(np.zeros(1), **(given | changes)).holds


@pytest.mark.parametrize(
    ("name", "met", "missed"),
    [
        ("volume", 0.99e-9, 1.01e-9),
        ("overtaken", 0.99e-6, 1.01e-6),
        ("carried", 0.999, 1.0),
        ("share", 1.01e-6, 0.99e-6),
    ],
)
def test_a_motion_proves_a_collapse_only_if_nothing_but_too_little_flow_resists_it(name, met, missed):
    """Changes of volume, closures of contacts, dissipation, and a gain that is more than what cancelling leaves."""
    assert proves(**{name: met})
    assert not proves(**{name: missed})


def test_what_resists_is_judged_by_the_dissipation_where_that_is_more_than_the_gain():
    motion = Mechanism(np.zeros(1), volume=2e-9, carried=3.0, overtaken=2e-6, share=1.0)
    assert motion.admissible
    assert not motion.holds
