"""Public objects with arrays: equal by their numbers or by what they are, keys, and read-only wherever they come from.

Copies come back from a pickle, as from another process, and from copy.deepcopy, as by dataclasses.asdict.
"""

import copy
import math
import pickle
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

from bipot import (
    Accuracy,
    Clarabel,
    Dissipation,
    Elasticity,
    Geometry,
    Perfect,
    Scene,
    Schedule,
    Support,
    Traction,
    Transfer,
    VonMises,
    block,
    conic_program,
    contact_problem,
    coulomb,
    limit_load,
    march,
    sensitivities,
    upsetting,
)
from bipot.typing import FrozenMap

FIRST = Schedule(45, first=0.001 / 0.45)

STRIP = Scene(
    block(6.0, 4.0, 2, 2),
    Geometry.PLANE_STRAIN,
    VonMises(Elasticity(2e5, 0.3), Perfect(200.0)),
    (Support("base", 0), Support("base", 1)),
    loads=(Traction("top", (0.0, 1.0)),),
)


@pytest.fixture(scope="module")
def accepted():
    return next(march(upsetting(mu=0.1, elements=2), FIRST))


@pytest.fixture(scope="module")
def slope():
    _, slopes = next(sensitivities(lambda mu: upsetting(mu=mu, elements=2), {"mu": 0.1}, FIRST))
    return slopes["mu"]


@pytest.fixture(scope="module")
def values(accepted, slope):
    """One of every public class that is equal by its numbers."""
    course, mesh = accepted.course, accepted.scene.mesh
    bound = limit_load(STRIP)
    moved = Transfer(course.state, 0.0, 0.0, 0.0)
    return mesh, course.state, course.state.flow, course.before[1], course, slope, bound, moved, mesh.boundaries


@pytest.fixture(scope="module")
def records(accepted):
    """One of every public class that is equal to itself alone."""
    found = contact_problem(accepted)
    program = conic_program(accepted, Dissipation()).conic()
    answer, _ = Clarabel().solve(program, Accuracy())
    solution = coulomb.solve(found.problem)
    return accepted, accepted.solved, found, found.problem, solution, program, program.rows[0], answer


def arrays(value):
    """All arrays of a value and of its parts."""
    if isinstance(value, np.ndarray):
        return [value]
    if isinstance(value, FrozenMap | tuple):
        parts = value.values() if isinstance(value, FrozenMap) else value
    else:
        parts = [getattr(value, field.name) for field in fields(value)] if is_dataclass(value) else []
    return [array for part in parts for array in arrays(part)]


def back(value):
    return pickle.loads(pickle.dumps(value)), copy.deepcopy(value)


def test_values_are_equal_where_all_their_numbers_are(values):
    for one in values:
        for other in back(one):
            assert other == one
            assert hash(other) == hash(one)
        assert one != 3
        assert len({one, *back(one)}) == 1


def test_values_of_other_numbers_differ(values):
    _, state, flow, paced, course, slope, bound, moved, boundaries = values
    nodes = state.nodes.copy()
    nodes[0, 0] = np.nextafter(nodes[0, 0], 1.0)
    for one, other in (
        (state, replace(state, nodes=nodes)),
        (state, replace(state, flow=None)),
        (state, replace(state, tau=0.5)),
        (flow, replace(flow, peeq=flow.peeq + 1.0)),
        (paced, replace(paced, middle=0.0)),
        (course, replace(course, state=replace(state, nodes=nodes))),
        (slope, replace(slope, nodes=nodes)),
        (bound, replace(bound, multiple=0.0)),
        (moved, replace(moved, state=replace(state, nodes=nodes))),
        (boundaries, boundaries | {"top": boundaries["top"][:1]}),
    ):
        assert one != other


def test_numbers_count_and_not_how_they_are_stored(values):
    """Zeros of either sign and numbers of either type are equal; so are two NaN, which say that nothing is known."""
    _, state, _, _, course, *_ = values
    assert math.isnan(course.size)
    assert replace(course, size=float("nan"), uncut=float("nan")) == course
    zero = replace(state, gap=0.0 * state.gap, tau=0.0)
    assert replace(zero, gap=-zero.gap, tau=-0.0) == zero
    assert hash(replace(zero, gap=-zero.gap, tau=-0.0)) == hash(zero)
    assert replace(state, length=1) == replace(state, length=1.0)
    assert dict(FrozenMap({"one": 1.0})) == FrozenMap({"one": 1})


def test_records_are_equal_to_themselves_alone_and_keys(records):
    for one in records:
        assert one == one
        assert one != copy.deepcopy(one)
        assert {one: 1}[one] == 1


def test_read_only_arrays_stay_so_in_copies(values):
    for one in values:
        assert all(not array.flags.writeable for copied in (one, *back(one)) for array in arrays(copied))


def test_problems_of_coulomb_stay_read_only_in_copies(records):
    problem = records[3]
    everywhere = coulomb.GlobalCoulombProblem(
        M=np.eye(2), H=np.eye(2), f=np.array([-2.0, 1.0]), w=np.zeros(2), mu=np.array(0.3), dim=2
    )
    for one in (*back(problem), *back(everywhere)):
        for name, part in vars(one).items():
            array = getattr(part, "data", part) if name in "WMH" else part
            assert not isinstance(array, np.ndarray) or not array.flags.writeable, name
