"""A flat tool that goes into a corner which no weighted mean feels is refused; at nodes it is felt."""

from itertools import pairwise

import numpy as np
import pytest

from bipot import (
    Control,
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    Newton,
    Perfect,
    Sampling,
    Scene,
    Schedule,
    Support,
    VonMises,
    block,
    brick,
    march,
)
from bipot.errors import IncrementFailed

STEEL = VonMises(Elasticity(210e3, 0.3), Perfect(300.0))


def askew(mesh, sampling, travel):
    """A body held at its base under a tool that comes upon one end of its top."""
    d = mesh.dimension
    lean = np.array([-2.0, -1.0]) if d == 2 else np.array([-1.0, -1.0, -1.0])
    normal = lean / np.linalg.norm(lean)
    first = mesh.nodes[np.argmin(mesh.nodes @ normal)]
    tool = FlatTool(tuple(first), tuple(normal), (*[0.0] * (d - 1), -travel), ("top",), 0.2, sampling=sampling)
    geometry = Geometry.SOLID if d == 3 else Geometry.PLANE_STRAIN
    return Scene(mesh, geometry, STEEL, tuple(Support("base", k) for k in range(d)), (tool,))


BODIES = {
    "H20": brick(2.0, 2.0, 2.0, 2, 2, 2, element=Element.H20),
    "T10": brick(2.0, 2.0, 2.0, 2, 2, 2, element=Element.T10),
    "Q8": block(2.0, 2.0, 2, 2, element=Element.Q8),
}


def forces(mesh, sampling, travel):
    done = march(askew(mesh, sampling, travel), Schedule(4), Control(Newton(), ()))
    return [float(np.linalg.norm(accepted.tool_forces[0])) for accepted in done]


@pytest.mark.parametrize("mesh", BODIES.values(), ids=BODIES)
def test_a_corner_that_no_mean_feels_is_refused_where_a_tool_is_deep_in_it(mesh):
    with pytest.raises(IncrementFailed, match=r"tools\[0\] is 0.[23]\d* deep in an edge at node \d+ and feels nothing"):
        forces(mesh, Sampling.WEIGHTED, 0.8)


@pytest.mark.parametrize("name", ["T10", "Q8"])
def test_it_is_felt_at_nodes(name):
    felt = forces(BODIES[name], Sampling.NODES, 0.2)
    assert all(a < b for a, b in pairwise([0.0, *felt]))


@pytest.mark.parametrize("mesh", BODIES.values(), ids=BODIES)
def test_it_is_not_refused_where_it_is_hardly_deep(mesh):
    assert len(forces(mesh, Sampling.WEIGHTED, 0.1)) == 4
