"""Scenes with deformable tools."""

from dataclasses import replace

import numpy as np

from bipot import (
    DeformableTool,
    Elastic,
    Elasticity,
    Element,
    Geometry,
    Linear,
    Prescribed,
    Scene,
    Support,
    Symmetry,
    VonMises,
    block,
    brick,
    cylinder,
    together,
)

STEEL = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 1000.0))
ELASTIC = Elastic(Elasticity(210e3, 0.3))


def shifted(mesh, *by):
    """The mesh moved by a vector."""
    return replace(mesh, nodes=mesh.nodes + np.array(by))


def stack(lower=3, upper=5, press=-0.01, mu=0.0, turn=0.0, material=ELASTIC, element=Element.Q4):
    """Two blocks on each other, of so many elements a side, turned by the angle ``turn``."""
    low, up = (block(1.0, 1.0, n, 2, element=element) for n in (lower, upper))
    mesh = together({"low": low, "up": shifted(up, 0.0, 1.0)})
    c, s = np.cos(turn), np.sin(turn)
    mesh = replace(mesh, nodes=mesh.nodes @ np.array([[c, s], [-s, c]]))
    along, across = (c, s), (-s, c)
    supports = (
        Support("low/base", across),
        Support("low/left", along),
        Support("up/left", along),
        Prescribed("up/top", across, press),
    )
    return Scene(mesh, Geometry.PLANE_STRAIN, material, supports, (DeformableTool(("low/top",), ("up/base",), mu),))


def pressed(mu=0.2, geometry=Geometry.AXISYMMETRIC, press=0.6, punch=ELASTIC, elements=4, element=Element.Q4):
    """A billet beneath a wider punch, onto which its side may fold; the punch is held at its top."""
    ring = geometry is Geometry.AXISYMMETRIC
    make, axis, side = (cylinder, "axis", "side") if ring else (block, "left", "right")
    billet = make(5.0, 5.0, elements, elements, element=element)
    above = shifted(make(7.0, 3.0, elements + 1, 2, element=element), 0.0, 5.0)
    mesh = together({"billet": billet, "punch": above})
    held = Support if ring else Symmetry
    supports = (
        Symmetry("billet/base", 1),
        held("billet/" + axis, 0),
        held("punch/" + axis, 0),
        Prescribed("punch/top", 1, -press),
    )
    tool = DeformableTool(("punch/base",), ("billet/top", f"billet/{side}"), mu)
    return Scene(mesh, geometry, STEEL, supports, (tool,), regions={"punch": punch})


def bulging(off, swapped=False):
    """A block whose base of 20 elements, an arc 0.08 high, is pressed by 0.04, from ``off`` less, into one element."""
    up = block(1.0, 0.5, 20, 2)
    x, y = up.nodes.T
    nodes = np.stack([x, y + 1 + off - 0.08 * 4 * x * (1 - x) * (1 - y / 0.5)], axis=1)
    mesh = together({"low": block(1.0, 1.0, 1, 2), "up": replace(up, nodes=nodes)})
    sides = (("low/top",), ("up/base",)) if swapped else (("up/base",), ("low/top",))
    supports = Support("low/base", 0), Support("low/base", 1), Support("up/top", 0), Prescribed("up/top", 1, -0.04)
    return Scene(mesh, Geometry.PLANE_STRAIN, ELASTIC, supports, (DeformableTool(*sides, 0.0),))


def flared(degrees, surface, dimension=2, swapped=False, fine=1, press=0.01, mu=0.0):
    """A block, its sides at an angle to the floor that it is pressed into, less deep than they would touch."""
    if dimension == 2:
        low, up = block(3.0, 1.0, 15 * fine, 5 * fine), block(1.0, 0.5, 4 * fine, 2 * fine)
    else:
        low, up = brick(3.0, 3.0, 1.0, 6, 6, 2), brick(1.0, 1.0, 0.5, 3, 3, 2)
    x, z = up.nodes[:, :-1], up.nodes[:, -1:]
    out = 1 + 2 * z / np.tan(np.radians(degrees))
    up = replace(up, nodes=np.hstack([1.53 + (x - 0.5) * out, z + 1.0]))
    supports = (
        *(Support("low/base", axis) for axis in range(dimension)),
        *(Support("up/top", axis) for axis in range(dimension - 1)),
        Prescribed("up/top", dimension - 1, -press),
    )
    sides = (("low/top",), surface) if swapped else (surface, ("low/top",))
    geometry = Geometry.PLANE_STRAIN if dimension == 2 else Geometry.SOLID
    return Scene(together({"low": low, "up": up}), geometry, ELASTIC, supports, (DeformableTool(*sides, mu),))
