"""Weighted contact where supports, tools and edges meet: forces add up, and the law is met by a recomputation."""

import numpy as np
import pytest

from bipot import (
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    Linear,
    Prescribed,
    Sampling,
    Scene,
    Schedule,
    Support,
    Symmetry,
    VonMises,
    block,
    march,
)

METAL = VonMises(Elasticity(70_000.0, 0.33), Linear(100.0, 700.0))
BASE, LEFT = Support("base", 1), Support("left", 0)
WALL, DRIVEN_WALL = Support("right", 0), Prescribed("right", 0, 0.05)


def pressed(sampling, *supports, element=Element.Q8, mu=0.3, slide=0.1):
    """A block on its base that a tool presses, and then slides along where ``slide`` says so."""
    tool = FlatTool(
        point=(0.0, 4.0),
        normal=(0.0, -1.0),
        travel=(slide, -0.05),
        path=((0.0, 0.0), (0.5, (0.0, 1.0)), (1.0, (1.0, 1.0))),
        candidates=("top",),
        mu=mu,
        sampling=sampling,
    )
    mesh = block(10.0, 4.0, 5, 2, element=element)
    return Scene(mesh, Geometry.PLANE_STRAIN, METAL, (BASE, *supports), (tool,))


@pytest.mark.parametrize("element", [Element.Q8, Element.Q9, Element.T6])
@pytest.mark.parametrize("supports", [(LEFT,), (LEFT, WALL), (LEFT, DRIVEN_WALL)], ids=["left", "both", "driven"])
def test_friction_where_a_support_holds_one_node_of_a_mean_is_felt_by_the_others(element, supports):
    """Tools and supports are in balance: a mean of which one node is held slips with its other nodes."""
    forces = list[np.ndarray]()
    for accepted in march(pressed(Sampling.WEIGHTED, *supports, element=element), Schedule(10)):
        solved, tool = accepted.solved, accepted.tool_forces[0]
        held = solved.iterate.reactions(solved.r).sum(axis=0)
        assert np.allclose(tool + held, 0.0, atol=1e-6 * np.linalg.norm(tool))
        forces.append(tool)
    if supports == (LEFT,):
        # at the end all of it slides
        assert forces[-1][0] == pytest.approx(-0.3 * forces[-1][1], rel=1e-6)


@pytest.mark.parametrize("element", [Element.Q8, Element.Q9])
def test_a_mean_cut_by_a_plane_of_symmetry_is_that_of_the_whole_body(element):
    """Its shear is zero there as in the middle of the whole body, whose mean has both halves."""

    platen = FlatTool((0.0, 4.0), (0.0, -1.0), (0.0, -0.2), ("top",), 0.1, sampling=Sampling.WEIGHTED)

    def scene(width, n_x, *supports):
        mesh = block(width, 4.0, n_x, 2, element=element)
        return Scene(mesh, Geometry.PLANE_STRAIN, METAL, (BASE, *supports), (platen,))

    half, whole = scene(9.0, 3, Symmetry("left", 0)), scene(18.0, 6)
    for part, both in zip(march(half, Schedule(5, 0.01)), march(whole, Schedule(5, 0.01)), strict=True):
        assert part.tool_force(0) == pytest.approx(both.tool_force(0), rel=1e-6, abs=1e-3)
        assert part.energies.friction == pytest.approx(both.energies.friction, rel=1e-6)
