"""Slabs pressed with constant shear and with Coulomb's law capped."""

from functools import cache

import numpy as np

from bipot import (
    Control,
    Elasticity,
    FlatTool,
    Geometry,
    Perfect,
    Scene,
    Schedule,
    Symmetry,
    VonMises,
    block,
    march,
)
from bipot.meshes.elements import Element

INF = float("inf")
SIGMA_Y = 300.0
SHEAR = SIGMA_Y / np.sqrt(3)
CONSTANT, OROWAN = (INF, 0.3), (0.3, 0.4)
SHORT = Schedule(10, first=0.005)


def slab(
    mu, shear, hardening=None, *, elements=(8, 4), reduction=0.2, scale=1.0, stress=1.0, element=Element.Q4, **tool
):
    """A quarter of a slab 16 x 8 (times ``scale``) pressed flat in plane strain."""
    return Scene(
        mesh=block(8.0 * scale, 4.0 * scale, *elements, element=element),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(210_000.0 * stress, 0.3), hardening or Perfect(SIGMA_Y * stress)),
        supports=(Symmetry("left", 0), Symmetry("base", 1)),
        tools=(
            FlatTool(
                (0.0, 4.0 * scale),
                (0.0, -1.0),
                (0.0, -reduction * 4.0 * scale),
                ("top", "right"),
                mu,
                shear=shear,
                **tool,
            ),
        ),
    )


@cache
def pressed(mu, shear, form=None):
    """The increments of a slab, all by one form."""
    control = Control() if form is None else Control(form, fallbacks=())
    return tuple(march(slab(mu, shear), SHORT, control))
