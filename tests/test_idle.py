"""Increments in which nothing is asked to move are taken, and change nothing."""

import numpy as np
import pytest

from bipot import (
    Bounds,
    Control,
    Dissipation,
    Elastic,
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    Newton,
    Sampling,
    Scene,
    Schedule,
    ShapedTool,
    Support,
    Tangent,
    brick,
    march,
    roll,
)

THEN_RESTS = ((0.0, 0.0), (0.4, 1.0), (1.0, 1.0))
HELD = tuple(Support("base", d) for d in range(3))
LEANING = (Support("left", 0), Support("front", 1), Support("base", 2))


def flat(travel):
    return FlatTool((0.0, 0.0, 0.5), (0.0, 0.0, -1.0), travel, ("top",), 0.3, THEN_RESTS, sampling=Sampling.WEIGHTED)


CASES = {
    "a block that spreads": (flat((0.0, 0.0, -0.03)), LEANING),
    "a plane that slides": (flat((0.03, 0.0, -0.03)), HELD),
    "a roll": (
        ShapedTool(
            roll((0.3, 0.0, 2.5), (0.0, 1.0, 0.0), 2.0),
            (0.0, 0.0, -0.03),
            ("top",),
            0.3,
            THEN_RESTS,
            sampling=Sampling.WEIGHTED,
        ),
        HELD,
    ),
}


@pytest.mark.parametrize("form", [Newton(), Tangent(), Dissipation()], ids=lambda form: type(form).__name__)
@pytest.mark.parametrize("case", CASES)
def test_tools_that_rest_move_nothing_in_any_number_of_increments(case, form):
    tool, supports = CASES[case]
    mesh = brick(1.0, 1.0, 0.5, 2, 2, 1, element=Element.H20)
    scene = Scene(mesh, Geometry.SOLID, Elastic(Elasticity(1e3, 0.3)), supports, (tool,))
    *_, before, first, second, third = march(scene, Schedule(5), Control(form, (), cuts=0))
    most = np.abs(before.state.forces).max()
    for accepted in (first, second, third):
        assert np.abs(accepted.state.forces - before.state.forces).max() < 1e-5 * most
        assert np.abs(accepted.state.nodes - before.state.nodes).max() < 1e-7
        measured = accepted.solved.certificate
        assert measured.relative_gap <= max(Bounds().relative_gap, measured.resolution.relative_gap)
        assert measured.law < 1e-6
        assert accepted.solved.undetermined == ()
    assert np.abs(third.state.du).max() < 1e-9


def test_an_increment_that_moves_decides_its_gap():
    tool, supports = CASES["a plane that slides"]
    mesh = brick(1.0, 1.0, 0.5, 2, 2, 1, element=Element.H20)
    scene = Scene(mesh, Geometry.SOLID, Elastic(Elasticity(1e3, 0.3)), supports, (tool,))
    first = next(march(scene, Schedule(5), Control(Newton(), ())))
    assert first.solved.certificate.resolution.relative_gap < 1e-9


@pytest.mark.parametrize("more", [0.0, 1e-12, 1e-10, 1e-8])
def test_units_of_a_stressed_body_have_stiffness_however_little_moves(more):
    """The program of `dissipation` keeps its answer: forces that differ by what is left of the way, and by 1e-7."""
    path = ((0.0, 0.0), (0.4, 1.0), (1.0, 1.0 + more))
    tool = FlatTool((0.0, 0.0, 0.5), (0.0, 0.0, -1.0), (0.0, 0.0, -0.03), ("top",), 0.3, path)
    scene = Scene(brick(1.0, 1.0, 0.5, 1, 1, 1), Geometry.SOLID, Elastic(Elasticity(1e3, 0.3)), LEANING, (tool,))
    *_, before, first, second, third = march(scene, Schedule(5), Control(Dissipation(), (), cuts=0))
    forces = [a.state.forces[:, 0].sum() for a in (before, first, second, third)]
    assert np.ptp(forces) < (1e-7 + 2 * more) * forces[0]
    units = third.solved.iterate.increment.units
    assert 1e3 * units.strain > 1e-7 * units.stress
