"""Scenes of bodies of several materials."""

from dataclasses import replace

from bipot import (
    Configuration,
    Control,
    Elastic,
    Elasticity,
    Element,
    FlatTool,
    Geometry,
    Layout,
    Linear,
    Pressure,
    Scene,
    Schedule,
    Support,
    Symmetry,
    VonMises,
    block,
    brick,
    march,
    ring,
    upsetting,
)

STEEL = VonMises(Elasticity(210e3, 0.3), Linear(300.0, 1000.0))
COPPER = VonMises(Elasticity(120e3, 0.34), Linear(80.0, 400.0))
HARD = Elastic(Elasticity(600e3, 0.22))
FEW = Schedule(3, first=0.01, settling=1, growth=4.0)


def middles(mesh):
    """The middles (e, d) of elements."""
    return mesh.nodes[mesh.elements[:, : mesh.element.corners]].mean(axis=1)


def split(mesh, at=0.5, axis=0, name="core"):
    """The mesh with the elements below ``at`` of its extent along the axis as a region."""
    x = middles(mesh)[:, axis]
    return replace(mesh, regions={name: x < mesh.nodes[:, axis].max() * at})


def billet(core=COPPER, element=Element.Q4, **changed):
    """A steel cylinder with a core, to be upset."""
    scene = upsetting(mu=0.2, elements=4, element=element, reduction=0.2, layout=Layout.TENSOR)
    scene = replace(scene, mesh=split(scene.mesh), material=STEEL, quadrature=None, volume=None)
    return replace(scene, regions={"core": core}, **changed)


def plane(core=COPPER):
    """A plane-strain block of two columns beneath a lid."""
    lid = FlatTool((0.0, 4.0), (0.0, -1.0), (0.0, -0.6), ("top", "right"), 0.2)
    mesh = split(block(4.0, 4.0, 4, 4))
    supports = Symmetry("left", 0), Symmetry("base", 1)
    return Scene(mesh, Geometry.PLANE_STRAIN, STEEL, supports, (lid,), regions={"core": core})


def solid(core=COPPER):
    """An eighth of a brick with a hard or soft middle beneath a lid."""
    lid = FlatTool((0.0, 0.0, 2.0), (0.0, 0.0, -1.0), (0.0, 0.0, -0.3), ("top", "right", "back"), 0.2)
    mesh = split(brick(2.0, 2.0, 2.0, 2, 2, 2))
    supports = Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2)
    return Scene(mesh, Geometry.SOLID, STEEL, supports, (lid,), regions={"core": core})


SCENES = {"meridian": billet, "Q8": lambda core: billet(core, Element.Q8), "plane strain": plane, "space": solid}


def last(scene, control=None, schedule=FEW):
    """The last increment of a march."""
    *_, accepted = march(scene, schedule, control or Control())
    return accepted


def lined(elements, liner, jacket, pressure):
    """A tube from 1 to 2 in a jacket to 3, in plane strain, under pressure."""
    mesh = ring(1.0, 3.0, 0.1, 2 * elements, 1, element=Element.Q4)
    mesh = replace(mesh, regions={"liner": middles(mesh)[:, 0] < 2.0})
    supports = Support("base", 1), Support("top", 1)
    loads = (Pressure("bore", pressure),)
    scene = Scene(mesh, Geometry.AXISYMMETRIC, jacket, supports, loads=loads, regions={"liner": liner})
    return replace(scene, configuration=Configuration.SMALL)
