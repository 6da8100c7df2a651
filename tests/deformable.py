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
