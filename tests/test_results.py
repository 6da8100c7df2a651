"""Results by name, against tensors of 3 x 3 put together by hand and against closed forms."""

import numpy as np
import pytest

from bipot import (
    Components,
    Control,
    Elastic,
    Elasticity,
    Geometry,
    Prescribed,
    Scene,
    SceneError,
    Schedule,
    Support,
    block,
    march,
    upsetting,
)
from bipot.certificate import Bounds
from bipot.increment import Limits
from bipot.meshes.elements import Element

YOUNG, POISSON = 1000.0, 0.25


@pytest.fixture(scope="module")
def upset():
    """An upsetting with friction: every component of stress and plastic strain is there."""
    return list(march(upsetting(mu=0.3, elements=2, reduction=0.1), Schedule(4, first=0.01, settling=1, growth=4.0)))


@pytest.fixture(scope="module")
def pulled():
    """An elastic block in plane strain, drawn along y by 1e-6 of its height and free along x."""
    scene = Scene(
        mesh=block(2.0, 1.0, 2, 1, element=Element.Q8),
        geometry=Geometry.PLANE_STRAIN,
        material=Elastic(Elasticity(YOUNG, POISSON)),
        supports=(Support("left", 0), Support("base", 1), Prescribed("top", 1, 1e-6)),
    )
    *_, last = march(scene, Schedule(1), Control(limits=Limits(Bounds(equilibrium=1e-11))))
    return last


def by_hand(mandel):
    """Tensors (…, 3, 3) of Mandel vectors (…, 4), entry by entry."""
    full = np.zeros((*mandel.shape[:-1], 3, 3))
    for k in range(3):
        full[..., k, k] = mandel[..., k]
    full[..., 0, 1] = full[..., 1, 0] = mandel[..., 3] / np.sqrt(2)
    return full


@pytest.mark.parametrize("what", ["stress", "plastic_strain"])
def test_components_are_those_of_the_tensor(upset, what):
    tensors, full = getattr(upset[-1], what), by_hand(getattr(upset[-1].state, what))
    assert tensors.names == ("rr", "zz", "tt", "rz")
    for name, (i, j) in {"rr": (0, 0), "zz": (1, 1), "tt": (2, 2), "rz": (0, 1)}.items():
        assert np.abs(tensors[name]).max() > 0
        np.testing.assert_allclose(tensors[name], full[..., i, j], rtol=1e-14)
    np.testing.assert_allclose(tensors.matrix, full, rtol=1e-14, atol=1e-14 * np.abs(full).max())


def test_mises_and_pressure_are_those_of_principal_stresses(upset):
    accepted = upset[-1]
    s1, s2, s3 = np.moveaxis(np.linalg.eigvalsh(by_hand(accepted.state.stress)), -1, 0)
    mises = np.sqrt(((s1 - s2) ** 2 + (s2 - s3) ** 2 + (s3 - s1) ** 2) / 2)
    np.testing.assert_allclose(accepted.mises, mises, rtol=1e-12)
    np.testing.assert_array_equal(accepted.mises, accepted.state.mises)
    np.testing.assert_allclose(accepted.pressure, -(s1 + s2 + s3) / 3, rtol=0, atol=1e-12 * mises.max())
    np.testing.assert_array_equal(accepted.peeq, accepted.state.peeq)
    np.testing.assert_allclose(mises[accepted.peeq > 0], 300.0, rtol=1e-9)


def test_displacement_is_the_sum_of_all_increments(upset):
    total = np.zeros_like(upset[0].state.du)
    for accepted in upset:
        total += accepted.state.du
        size = np.abs(accepted.state.nodes).max()
        np.testing.assert_allclose(accepted.displacement, total, rtol=0, atol=1e-15 * size)


def test_a_bar_in_plane_strain_has_its_components(pulled):
    """sigma_yy = E/(1 - nu^2) e, sigma_zz = nu sigma_yy, sigma_xx = sigma_xy = 0; u_x = -nu/(1 - nu) e x."""
    strain = 1e-6
    along = YOUNG * strain / (1 - POISSON**2)
    expected = {"xx": 0.0, "yy": along, "zz": POISSON * along, "xy": 0.0}
    assert tuple(expected) == pulled.stress.names
    for name, value in expected.items():
        np.testing.assert_allclose(pulled.stress[name], value, rtol=1e-5, atol=1e-9 * along)
    np.testing.assert_allclose(pulled.pressure, -(1 + POISSON) * along / 3, rtol=1e-5)
    x = pulled.start.nodes[:, 0]
    np.testing.assert_allclose(pulled.displacement[:, 0], -POISSON / (1 - POISSON) * strain * x, rtol=1e-5, atol=1e-15)


def test_in_space_every_shear_has_its_name():
    vector = np.array([1.0, 2.0, 3.0, 4.0 * np.sqrt(2), 5.0 * np.sqrt(2), 6.0 * np.sqrt(2)])
    tensors = Components(vector, Geometry.SOLID)
    found = {name: float(tensors[name]) for name in tensors.names}
    assert found == pytest.approx({"xx": 1, "yy": 2, "zz": 3, "xy": 4, "yz": 5, "xz": 6}, rel=1e-15)
    np.testing.assert_allclose(tensors.matrix, [[1, 4, 6], [4, 2, 5], [6, 5, 3]], rtol=1e-15)


@pytest.mark.parametrize("name", ["xy", "zr", "RZ", "", 3, None, ("rz",), ["rz"], np.array([0, 1])])
def test_an_unknown_component_is_refused_with_the_known_ones(upset, name):
    with pytest.raises(SceneError, match=r"component = .*: must be one of rr, zz, tt, rz \(axisymmetric\)"):
        upset[-1].stress[name]


def test_vectors_of_another_length_and_unknown_geometries_are_refused():
    with pytest.raises(SceneError, match=r"mandel = .*\(3,\).*: must be of shape \(…, 4\)"):
        Components(np.zeros(3), Geometry.PLANE_STRAIN)
    with pytest.raises(SceneError, match=r"geometry = 'solid': must be a Geometry, e\.g\. Geometry\.SOLID"):
        Components(np.zeros(6), "solid")  # pyright: ignore[reportArgumentType]
