"""Quadratic meshes of cylinders and rings in space: arcs of all layers, not of the boundary alone."""

import numpy as np
import pytest

from bipot.fem.orientation import scaled_jacobians
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Newton
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.solids import cylinder_3d, ring_3d
from bipot.scene.loads import Pressure
from bipot.scene.scene import Scene
from bipot.scene.supports import Support, Symmetry


@pytest.mark.parametrize("element", [Element.H20, Element.T10])
def test_a_thin_ring_of_several_layers_widens_by_what_lame_says(element):
    """With arcs on its two circles alone it was off by 37 % in two layers of H20, and folded in three."""
    thin, young, poisson, load = 1.1, 1e3, 0.3, 0.1
    mesh = ring_3d(1.0, thin, 0.5, 3, 2, 1, element=element)
    scene = Scene(
        mesh,
        Geometry.SOLID,
        Elastic(Elasticity(young, poisson)),
        (Symmetry("left", 0), Symmetry("front", 1), Support("base", 2), Support("top", 2)),
        loads=(Pressure("bore", load),),
        configuration=Configuration.SMALL,
    )
    *_, last = march(scene, Schedule(1), Control(Newton()))
    bore = mesh.boundary_nodes("bore")
    moved = np.vecdot(last.displacement[bore], mesh.nodes[bore] * (1, 1, 0))
    exact = load * (1 + poisson) / young * (1 - 2 * poisson + thin**2) / (thin**2 - 1)
    np.testing.assert_allclose(moved, exact, rtol=0.01)


@pytest.mark.parametrize("element", [Element.H20, Element.T10])
@pytest.mark.parametrize("inscribed", [True, False])
def test_arcs_of_a_ring_are_concentric(element, inscribed):
    mesh = ring_3d(0.9, 1.0, 1.0, 2, 6, 1, element=element, inscribed=inscribed)
    radius = np.linalg.norm(mesh.nodes[:, :2], axis=1)[mesh.elements[:, element.edges]]
    first, middle, last = np.moveaxis(radius, -1, 0)
    along = np.isclose(first, last, rtol=1e-12)
    np.testing.assert_allclose(middle[along], first[along], rtol=1e-12)
    # Diagonals of tetrahedra are as far out as their ends are on average.
    np.testing.assert_allclose(middle, (first + last) / 2, rtol=2e-3)


@pytest.mark.parametrize("element", [Element.H20, Element.T10])
@pytest.mark.parametrize("layers", [1, 6])
def test_layers_of_a_cylinder_have_no_thin_places(element, layers):
    """Their arcs fade towards the square inside."""
    mesh = cylinder_3d(1.0, 1.0, 1, layers, 1, element=element)
    assert scaled_jacobians(mesh.nodes, mesh.elements).min() > {Element.H20: 0.48, Element.T10: 0.7}[element]
