"""Bodies that are hard to draw anew: flat elements in any direction, few points, other bodies than squares."""

from dataclasses import replace

import numpy as np
import pytest

from bipot import Configuration, Element, Quadrature, block, brick, transferred
from bipot.fem.elements import RULES, tabulated
from bipot.system import system_of
from bipot.transfer import _interpolated
from tests.scenes import refused
from tests.test_transfer import NEWTON, bar_of, drawn, left_by, pressed


def points(mesh):
    """Integration points (e, q, d) of the default rule."""
    return tabulated(mesh.element, RULES[mesh.element][0]).values @ mesh.nodes[mesh.elements]


@pytest.mark.parametrize("angle", [0.0, 0.3, 0.5, np.pi / 4, 2.0])
@pytest.mark.parametrize(
    ("old", "new"),
    [
        (block(1.0, 0.1, 20, 20), block(1.0, 0.1, 17, 23)),
        (block(1.0, 0.01, 20, 20), block(1.0, 0.01, 17, 23)),
        (block(1.0, 0.001, 20, 20), block(1.0, 0.001, 17, 23)),
        (block(1.0, 0.01, 20, 20, element=Element.T3), block(1.0, 0.01, 17, 20)),
        (block(1.0, 1.0, 20, 20, grading=(100.0, 100.0)), block(1.0, 1.0, 9, 9)),
        (brick(1.0, 1.0, 0.01, 4, 4, 8), brick(1.0, 1.0, 0.01, 5, 5, 3)),
    ],
)
def test_linear_fields_are_met_by_flat_elements_in_any_direction(old, new, angle):
    """The nearest points of a column of flat elements are on a line but for round-off."""
    x, y = points(old), points(new)
    d, turn = x.shape[-1], np.eye(x.shape[-1])
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    slopes = np.random.default_rng(1).normal(size=(d, 3)) / np.ptp(old.nodes, axis=0)[:, None]
    found = _interpolated(x @ turn.T, x @ slopes, y @ turn.T)
    np.testing.assert_allclose(found, y @ slopes, atol=1e-8)


@pytest.mark.parametrize("unit", [1e-9, 1e-6, 1e-3, 1e6])
def test_curved_fields_are_the_same_in_any_unit_of_length(unit):
    """As of a body of a few micrometres in metres, or of a grid with elements that fine."""
    x, y = points(block(1.0, 1.0, 20, 20)), points(block(1.0, 1.0, 17, 23))
    field = np.sin(3 * x[..., :1]) * np.cos(2 * x[..., 1:])
    found = _interpolated(unit * x, field, unit * y)
    np.testing.assert_allclose(found, np.sin(3 * y[..., :1]) * np.cos(2 * y[..., 1:]), atol=3e-4)
    np.testing.assert_allclose(found, _interpolated(x, field, y), atol=1e-12)


@pytest.mark.parametrize("mesh", [block(1.0, 1.0, 8, 8), brick(1.0, 1.0, 1.0, 6, 6, 6)], ids=["plane", "space"])
def test_numbers_of_points_do_not_matter_even_where_many_are_as_near(mesh):
    """As at the middle of the elements of a grid; places of other numbers have another round-off."""
    x = points(mesh)
    y, d = mesh.nodes[mesh.elements].mean(axis=1, keepdims=True), x.shape[-1]
    rng, field = np.random.default_rng(2), np.sin(3 * x.sum(axis=-1, keepdims=True))
    found = _interpolated(x, field, y)
    for _ in range(2):
        other = rng.permutation(x.size // d)
        shaken = x.reshape(-1, d) * (1 + 1e-15 * rng.uniform(-1, 1, (x.size // d, d)))
        again = _interpolated(shaken[other][None], field.reshape(-1, 1)[other][None], y)
        np.testing.assert_allclose(again, found, atol=1e-11)


@pytest.mark.parametrize("mesh", [block(1.0, 1.0, 8, 8), brick(1.0, 1.0, 1.0, 6, 6, 6)], ids=["plane", "space"])
def test_mirror_images_have_mirrored_fields(mesh):
    """All points as near as the farthest of a spline are its own: some of them would be others in the image."""
    x = points(mesh)
    y = np.concatenate([mesh.nodes[mesh.elements].mean(axis=1), mesh.nodes])[None]
    field = np.sin(3 * x.sum(axis=-1, keepdims=True)) + np.cos(5 * x[..., 1:2])
    found = _interpolated(x, field, y)
    for axis in range(x.shape[-1]):
        way = np.where(np.arange(x.shape[-1]) == axis, -1.0, 1.0)
        np.testing.assert_allclose(_interpolated(way * x, field, way * y), found, atol=1e-11)
    swapped = _interpolated(x[..., ::-1], field, y[..., ::-1])
    np.testing.assert_allclose(swapped, found, atol=1e-11)


@pytest.mark.parametrize(
    "mesh", [block(1.0, 1.0, 1, 1, element=Element.T3), brick(1.0, 1.0, 1.0, 1, 1, 1, element=Element.T4)]
)
def test_points_on_a_line_or_in_a_plane_are_too_few(mesh):
    x = points(mesh)
    refused(
        lambda: _interpolated(x, x, x), "scene.mesh = 'with . points': must be such that its integration points are"
    )


def changed(array, value):
    """The array with another first number."""
    array = array.copy()
    array.flat[0] = value
    return array


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s: {"nodes": s.nodes[:-3]}, "nodes = 'of shape"),
        (lambda s: {"nodes": np.vstack([s.nodes, s.nodes])}, "nodes = 'of shape"),
        (lambda s: {"nodes": changed(s.nodes, np.nan)}, "nodes = 'NaN or infinite'"),
        (lambda s: {"nodes": changed(s.nodes, 5.0)}, "nodes"),
        (lambda s: {"plastic_strain": s.plastic_strain[1:]}, "plastic_strain = 'of shape"),
        (lambda s: {"peeq": s.peeq[1:]}, "peeq = 'of shape"),
        (lambda s: {"peeq": changed(s.peeq, -1.0)}, "peeq = -1.0: must be >= 0"),
        (lambda s: {"stress": 50 * s.stress}, r"stress = '32.\d+ of the yield stress': must be within it"),
    ],
)
def test_a_state_from_which_its_own_scene_could_not_go_on_is_refused(change, words):
    scene = pressed(bar_of(4, 2))
    state = left_by(scene)
    onto = pressed(drawn(scene, state.nodes, bar_of(5, 3)), top=0.9)
    words = f"state: must be of a march of the scene, as its start: start.{words}"
    refused(lambda: transferred(replace(state, **change(state)), scene, onto, NEWTON), words)


def test_a_state_of_elements_with_as_many_points_and_other_nodes_is_refused():
    one, other = (pressed(bar_of(4, 2, kind), quadrature=Quadrature.GAUSS3) for kind in (Element.Q8, Element.Q9))
    refused(lambda: transferred(system_of(one).rest(), other, other), "start.nodes = 'of shape")


def test_small_displacements_draw_no_body_anew():
    """Equilibrium is then that of the mesh at rest, and the force on the deformed body is another one."""
    scene, small = (pressed(bar_of(4, 2), configuration=c) for c in (Configuration.MIDPOINT, Configuration.SMALL))
    state = system_of(scene).rest()
    refused(lambda: transferred(state, small, scene), "scene.configuration = 'small': must be another one")
    refused(lambda: transferred(state, scene, small), "onto.configuration = 'small': must be another one")


def test_a_refusal_tells_places_of_a_small_body():
    """Those of micrometres in metres are not rounded to zero."""
    scene, other = (pressed(block(*sides, 4, 2), top=1.0) for sides in ((2.0, 1.0), (1.5, 4 / 3)))
    small, wrong = (replace(s, mesh=replace(s.mesh, nodes=1e-6 * s.mesh.nodes), tools=()) for s in (scene, other))
    words = r"onto.mesh: its least .*: must be the deformed body's, \[\[0.0, 0.0\], \[2e-06, 1e-06\]\]"
    refused(lambda: transferred(system_of(small).rest(), small, wrong), words)
