"""Weighted contact where supports, tools and edges meet: forces add up, and the law is met by a recomputation."""

import numpy as np
import pytest

from bipot import (
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    Linear,
    Mesh,
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
from bipot.contact.sampling import points
from bipot.control.estimate import error_estimate
from bipot.tensors import norm

METAL = VonMises(Elasticity(70_000.0, 0.33), Linear(100.0, 700.0))
BASE, LEFT = Support("base", 1), Support("left", 0)
WALL, DRIVEN_WALL = Support("right", 0), Prescribed("right", 0, 0.05)


def pressed(sampling, *supports, element=Element.Q8, mu=0.3, slide=0.1, press=0.05):
    """A block on its base that a tool presses, and then slides along where ``slide`` says so."""
    tool = FlatTool(
        point=(0.0, 4.0),
        normal=(0.0, -1.0),
        travel=(slide, -press),
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


@pytest.mark.parametrize("slope", [0.0, 0.4, 0.8], ids=["flat", "bent", "creased"])
@pytest.mark.parametrize("element", [Element.Q8, Element.Q9])
def test_a_mean_at_a_plane_of_symmetry_is_that_of_the_whole_body(element, slope):
    """Its shear is zero as in the middle of the whole body, unless that has an edge where two means end."""
    tool = FlatTool((0.0, 4.0), (0.0, -1.0), (0.0, -0.2 - slope), ("top",), 0.3, sampling=Sampling.WEIGHTED)

    def scene(width, left, n_x, *supports):
        flat = block(width, 4.0, n_x, 2, element=element)
        x = flat.nodes - [left, 0.0]
        x[:, 1] *= 1 - slope * np.abs(x[:, 0]) / 4
        mesh = Mesh(x, flat.elements, flat.boundaries)
        return Scene(mesh, Geometry.PLANE_STRAIN, METAL, (BASE, *supports), (tool,))

    half, whole, pushed = scene(4.0, 0.0, 2, Symmetry("left", 0)), scene(8.0, 4.0, 4), 0.0
    for part, both in zip(
        march(half, Schedule(5, 0.01, settling=1, growth=4.0)),
        march(whole, Schedule(5, 0.01, settling=1, growth=4.0)),
        strict=True,
    ):
        assert part.tool_force(0) == pytest.approx(both.tool_force(0), rel=1e-6, abs=1e-3)
        assert part.energies.friction == pytest.approx(both.energies.friction, rel=1e-5)
        pushed = -part.tool_force(0)[1]
    assert pushed > 100.0


@pytest.mark.slow
def test_round_off_in_a_body_that_rests_does_not_choose_the_increments():
    """A tool that slides on strains the block no more: its increments double until the path is at its end."""
    scene = pressed(Sampling.NODES, LEFT, element=Element.Q4, slide=0.3, press=0.2)
    slide = march(scene, Schedule(accuracy=1e-4))
    rests = [accepted for accepted in slide if norm(accepted.state.du).max() < 1e-14 * scene.size]
    assert len(rests) > 1
    assert max(error_estimate(accepted.start, accepted.solved) for accepted in rests) < 1e-12


def test_where_parts_of_the_body_meet_in_a_node_every_edge_has_its_own_mean():
    """A block with two holes that share a corner: of its four edges none goes on as another."""
    whole = block(4.0, 4.0, 4, 4, element=Element.Q8)
    middles = whole.nodes[whole.elements[:, :4]].mean(axis=1)
    out = (np.abs(middles - 1.5) < 0.1).all(axis=1) | (np.abs(middles - 2.5) < 0.1).all(axis=1)
    used, cells = np.unique(whole.elements[~out], return_inverse=True)
    around = [cell[[k, 4 + k, (k + 1) % 4]] for cell in whole.elements[out] for k in range(4)]
    names = {"base": whole.boundary("base"), "hole": np.array(around)}
    mesh = Mesh(whole.nodes[used], cells.reshape(-1, 8), {name: np.searchsorted(used, e) for name, e in names.items()})
    tool = FlatTool((0.0, -1.0), (0.0, 1.0), (0.0, 0.0), ("hole",), 0.1, sampling=Sampling.WEIGHTED)
    own = points(mesh, Geometry.PLANE_STRAIN, tool)
    (shared,) = np.flatnonzero((mesh.nodes == [2.0, 2.0]).all(axis=1))
    assert (own.node == shared).sum() == 4
    # each is the mean of the two nodes of one edge that are next to it, as at the other corners
    assert (np.bincount(own.point.ravel()) == 1).all()
    assert np.diff(own.weights.indptr).tolist() == [2] * 16
