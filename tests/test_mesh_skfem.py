"""Meshes of scikit-fem: the native mesh again, what was given kept, or a refusal in words."""

import numpy as np
import pytest
import skfem

from bipot.errors import SceneError
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.mesh import Mesh
from bipot.meshes.sections import block
from tests.scenes import scene


def tensor():
    return skfem.MeshQuad.init_tensor(np.linspace(0, 1, 4), np.linspace(0, 1, 3)).with_defaults()


def triangles():
    """Some are numbered clockwise."""
    return skfem.MeshTri.init_tensor(np.linspace(0, 1, 4), np.linspace(0, 1, 3)).with_defaults()


GIVEN = {
    Element.Q4: tensor(),
    Element.Q9: skfem.MeshQuad2.from_mesh(tensor()).with_defaults(),
    Element.T3: triangles(),
    Element.T6: skfem.MeshTri2.from_mesh(triangles()).with_defaults(),
}


def based(mesh):
    """The mesh with the lower boundary called base."""
    boundaries = dict(mesh.boundaries)
    boundaries["base"] = boundaries.pop("bottom")
    return Mesh(mesh.nodes, mesh.elements, boundaries)


def forces(mesh):
    return np.array([a.tool_forces for a in march(scene(mesh=mesh), Schedule(2), Control())])


@pytest.mark.parametrize("element", [Element.Q4, Element.Q8, Element.Q9])
def test_a_mesh_of_scikit_fem_gives_the_forces_of_the_native_one(element):
    given = GIVEN[Element.Q4 if element is Element.Q4 else Element.Q9]
    mesh = based(Mesh.from_skfem(given)).to(element)
    native = block(1.0, 1.0, 3, 2, element=element)
    assert sorted(mesh.boundaries) == sorted(native.boundaries)
    expected = forces(native)
    np.testing.assert_allclose(forces(mesh), expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("element", GIVEN)
def test_what_is_given_is_kept_and_marches(element):
    mesh = based(Mesh.from_skfem(GIVEN[element]))
    assert mesh.element is element
    np.testing.assert_allclose(mesh.nodes[mesh.boundary("top")][..., 1], 1.0)
    lower = forces(mesh)[-1, 0, 1]
    assert lower == pytest.approx(forces(block(1.0, 1.0, 6, 4, element=Element.Q8))[-1, 0, 1], rel=0.05)


def test_the_curved_geometry_of_scikit_fem_is_kept():
    given = GIVEN[Element.Q9]
    bent = given.doflocs + 0.1 * np.array([0 * given.doflocs[0], np.sin(3 * given.doflocs[0])])
    mesh = Mesh.from_skfem(skfem.MeshQuad2(bent, given.t))
    straight = 4 * (mesh.nodes[:, 1] - 0.1 * np.sin(3 * mesh.nodes[:, 0]))
    np.testing.assert_allclose(straight, np.round(straight), rtol=0, atol=1e-13)
    assert mesh.boundaries == {}


def test_an_empty_boundary_of_scikit_fem_is_refused():
    with pytest.raises(SceneError, match="mesh boundary 'none' = 'empty'"):
        Mesh.from_skfem(tensor().with_boundaries({"none": np.empty(0, int)}))


@pytest.mark.parametrize(
    "given", [skfem.MeshHex2(), skfem.MeshWedge1(), skfem.MeshLine(), block(1.0, 1.0, 1, 1, element=Element.Q8), None]
)
def test_meshes_of_other_elements_are_refused(given):
    with pytest.raises(SceneError, match=r"one of scikit-fem, of .*ElementHex1"):
        Mesh.from_skfem(given)
