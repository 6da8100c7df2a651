"""Every example runs, prints and draws what is right; run shorter than shown, the physics is the same."""

import ast
import importlib.util
from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot

FOLDER = Path(__file__).parents[1] / "examples"
NAMES = sorted(path.stem for path in FOLDER.glob("*.py"))


@pytest.fixture
def run(capsys):
    """Run ``main`` of an example with short settings: its answer, and something was printed."""

    def run(name, **settings):
        spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        assert capsys.readouterr().out == ""
        found = module.main(**settings)
        assert capsys.readouterr().out.strip()
        module.draw(found)
        assert all(ax.has_data() for ax in pyplot.figure(pyplot.get_fignums()[-1]).axes)
        pyplot.close("all")
        return found

    return run


def test_the_page_of_scenes_lists_every_example():
    page = (FOLDER.parent / "docs" / "scenes.md").read_text(encoding="utf-8")
    assert [name for name in NAMES if f"| `examples/{name}.py` |" not in page] == []


def test_friction_adds_to_the_force_of_a_block_between_platens(run):
    found = run("platens", increments=6, friction=(0.0, 0.3))
    # Without friction the block stays one: volume gives its width, strain its stress.
    strain = 2 / np.sqrt(3) * np.log(1 / 0.9)
    uniform = 2 / np.sqrt(3) * (100.0 + 200.0 * strain) * 40.0 / 0.9
    forces = {mu: -last.tool_force(0)[1] for mu, last in found.items()}
    assert forces[0.0] == pytest.approx(uniform, rel=5e-3)
    assert forces[0.3] > 1.2 * forces[0.0]


@pytest.mark.slow
def test_friction_and_hardening_are_found_from_a_ring_test(run):
    metal, deviations, read, curves = run("identified", elements=2)
    # Off by the mesh, which is half as fine as that of the test, and by what the instruments round.
    np.testing.assert_allclose(metal, (0.12, 620.0, 0.21), rtol=0.02)
    assert (deviations > 0).all()
    assert (deviations < 0.01 * np.array(metal)).all()
    assert (np.abs(curves["found"] - read) < (0.1, 0.005)).all()
    assert np.abs(curves["guess"] - read).max(axis=0)[0] > 5.0


@pytest.mark.slow
def test_the_bore_of_a_ring_opens_or_closes_by_constant_shear(run):
    found = run("ring_compression", increments=12, elements=2, shear=(0.0, 0.1, 0.25, 0.3, 1.0))
    reductions = np.array([0.1, 0.3, 0.5])
    # Without friction the ring stays one, and volume gives its bore.
    np.testing.assert_allclose(found[0.0][:, :2], np.outer(100 * (1 - (1 - reductions) ** -0.5), [1, 1]), rtol=1e-3)
    np.testing.assert_allclose(found[0.0][:, 2], 1.0, rtol=1e-3)
    # Avitzur's upper bound (decrease of the bore in %, mean pressure): no true pressure is above it.
    bounds = {0.1: [1.072, 1.098, 1.146], 0.3: [1.173, 1.230, 1.355], 1.0: [1.411, 1.595, 2.062]}
    for m, bound in bounds.items():
        assert (found[m][:, 2] < bound).all()
        assert (found[m][:, 2] > 1.0).all()
    assert np.abs(found[0.1][:, :2] - np.array([[-3.32], [-10.0], [-13.64]])).max() < 3.0
    assert (found[0.1][:, :2] < 0).all()
    assert all((found[m][:, :2] > 0).all() for m in (0.3, 1.0))
    # The bore stays as it is somewhere between m = 0.1 and 0.25.
    assert (found[0.25][:, 0] > 0.2).all()


def test_a_tube_is_elastic_first_and_then_gives_way(run):
    rows = np.array(run("tube", increments=4))
    p, u, elastic = rows.T
    assert p[-1] == 160.0
    np.testing.assert_allclose(u[p <= 80], elastic[p <= 80], rtol=2e-3)
    assert u[-1] > 1.15 * elastic[-1]


def test_a_body_drawn_anew_is_pressed_on_where_its_elements_would_have_folded(run):
    one, anew, before, after = run("drawn_anew", heights=(2.5, 2.1))
    assert 2.15 < one[-1, 0] < 2.25
    assert anew[:, 0].min() == pytest.approx(2.1, abs=1e-6)
    # Until one folds both meshes err by as much as nodes that land make the force jump.
    shared = one[one[:, 0] < 2.45]
    np.testing.assert_allclose(np.interp(-shared[:, 0], *(anew * (-1, 1)).T), shared[:, 1], rtol=0.06)
    assert before.nodes[:, 1].max() == pytest.approx(after.nodes[:, 1].max(), abs=1e-9)


def test_an_upset_cylinder_springs_back_by_its_elastic_strain(run):
    loaded, free, expected, _ = run("springback", increments=4)
    assert loaded == pytest.approx(4.5)
    assert free - loaded == pytest.approx(expected - loaded, rel=1e-2)


def test_friction_is_mu_times_the_normal_force_where_all_slides(run):
    rows = np.array(run("press_then_slide", increments=6))
    tau, ratio = rows.T
    np.testing.assert_allclose(ratio[tau <= 0.5], 0.0, atol=1e-9)
    np.testing.assert_allclose(ratio[tau > 0.8], 0.2, rtol=1e-9)


def test_a_table_is_given_back_by_force_and_area(run):
    strain, stress, table = np.array(run("hardening_from_csv", increments=10)).T
    assert strain[-1] > 0.2
    np.testing.assert_allclose(stress[strain > 0], table[strain > 0], rtol=1e-4)


def test_a_mesh_of_a_file_has_its_boundaries_and_marches(run):
    assert run("mesh_from_file", increments=2)[0] == {"axis": 3, "side": 3, "base": 3, "top": 3}


def test_two_metals_share_the_force_by_their_areas_without_friction(run):
    found = run("clad_billet", accuracy=1e-2, elements=4)
    force = {mu: {name: -last.tool_force(0)[1] for name, last in lasts.items()} for mu, lasts in found.items()}
    steel, copper = force[0.0]["steel"], force[0.0]["copper"]
    # Each stays a cylinder: height and volume, less what is elastic, give its plastic strain and its area.
    for alone, young, poisson, first, modulus in (
        (steel, 210e3, 0.3, 300.0, 1000.0),
        (copper, 120e3, 0.34, 80.0, 400.0),
    ):
        stress = (first - modulus * np.log(0.6)) / (1 + modulus / young)
        area = np.pi * 25.0 / 0.6 * np.exp(-stress * (1 - 2 * poisson) / young)
        assert alone == pytest.approx(stress * area, rel=1e-3)
    assert force[0.0]["copper core"] == pytest.approx(0.25 * copper + 0.75 * steel, rel=1e-4)
    assert force[0.0]["steel core"] == pytest.approx(0.25 * steel + 0.75 * copper, rel=1e-4)
    assert force[0.2]["copper core"] < 0.98 * (0.25 * force[0.2]["copper"] + 0.75 * force[0.2]["steel"])
    # With friction the core bulges, the soft one by more.
    bulge = {}
    for name in ("copper core", "steel core"):
        last = found[0.2][name]
        r, z = last.state.nodes[np.unique(last.scene.mesh.interfaces)].T
        bulge[name] = r[z == 0.0][0] / r[np.argmax(z)]
    assert bulge["copper core"] > bulge["steel core"] > 1.1


def test_two_solvers_of_the_stated_increment_find_the_forces_of_the_march(run):
    found = run("increment_in_cvxpy", increments=4)
    (one, off), (other, also_off) = found.values()
    assert one == pytest.approx(other, rel=1e-7)
    assert max(off, also_off) < 1e-6


@pytest.mark.slow
def test_a_rolled_strip_comes_in_slower_than_the_roll_and_leaves_faster(run):
    _, torque, before, behind = np.array(run("rolling", increments=50, elements=2)[0])[-25:].T
    assert (torque > 0).all()
    assert (before < 1).all()
    assert (behind > 1).all()
    # What comes in leaves, at the height that the roll leaves, or a little more: it springs back.
    assert before.mean() / behind.mean() == pytest.approx(1 - 0.75 / 5, rel=0.02)


def test_a_sphere_presses_an_elastic_block_as_hertz_says(run):
    force, expected, a, radius = np.array(run("hertz", increments=3, elements=24)).T
    np.testing.assert_allclose(force, expected, rtol=0.02)
    np.testing.assert_allclose(a, radius, rtol=0.06)


@pytest.mark.slow
def test_a_sphere_meets_nearly_three_yield_stresses_and_a_rim_piles_up(run):
    _, pressure, rim = np.array(run("sphere_indentation", increments=10, elements=16)[0]).T
    # A node more or less on the edge of the contact is 15 % of its area on this mesh.
    assert 2.3 < pressure[-4:].mean() < 3.1
    assert (rim[-4:] > 0.01).all()


@pytest.mark.slow
def test_the_force_of_coining_rises_as_the_die_fills(run):
    _, force, gap = np.array(run("coining", increments=30, elements=6)[0]).T
    assert (np.diff(gap[5:]) < 0).all()
    assert force[-1] > 1.5 * force[len(force) // 2]


def test_a_sphere_dents_a_block_in_space_as_on_a_meridian(run):
    curves, last = run("dented_block", increments=5, elements=4)
    space, ring = (np.array(curves[name])[:, 1] for name in ("in space", "on a meridian"))
    # Each node that comes to touch is a step of either force, at depths of their own.
    assert space.sum() == pytest.approx(ring.sum(), rel=0.2)
    assert (last.solved.r[:, 0] > 0).sum() >= 4


def test_the_moment_that_twists_a_pressed_disc_tends_to_two_thirds(run):
    angle, moment = np.array(run("twisted_disc", increments=10, elements=2)[0]).T
    assert moment[0] == pytest.approx(0.0, abs=1e-12)
    assert angle[-1] == pytest.approx(0.01)
    assert moment[-1] == pytest.approx(2 / 3, rel=0.02)
    # Elastic at first: G J angle / h over mu N R, where all sticks.
    assert moment[1] == pytest.approx(500 * np.pi * 10**4 / 2 * angle[1] / 5 / (0.2 * 10 * np.pi * 10**3), rel=0.05)


@pytest.mark.slow
def test_friction_makes_the_sides_of_a_block_in_space_bulge(run):
    found = run("upset_block", increments=6, elements=3, friction=(0.0, 0.3))
    forces = {mu: -last.tool_force(0)[2] for mu, last in found.items()}
    assert forces[0.0] == pytest.approx(300.0 * 100.0 / 0.8, rel=2e-3)
    assert forces[0.3] > 1.05 * forces[0.0]
    sides = {mu: last.state.nodes[last.scene.mesh.boundary_nodes("right"), 0] for mu, last in found.items()}
    assert np.ptp(sides[0.0]) < 1e-6
    assert np.ptp(sides[0.3]) > 0.5


def test_a_picture_that_cannot_be_made_is_missed_in_words(run, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with monkeypatch.context() as patched:
        patched.setattr(pyplot, "close", lambda *given: None)
        run("upset_block", increments=2, elements=1, friction=(0.3,))
    said = [text.get_text() for text in pyplot.gcf().axes[0].texts]
    pyplot.close("all")
    assert said == ["no picture: pyvista is not installed"]


@pytest.mark.slow
def test_a_ring_in_space_is_the_ring_of_a_meridian(run):
    for mu, (flat, solid) in run("ring_in_space", increments=5, elements=2).items():
        assert (solid[-1, 1] > 0) == (mu < 0.1)
        np.testing.assert_allclose(solid[:, 1], flat[:, 1], atol=0.2)
        np.testing.assert_allclose(solid[:, 2], flat[:, 2], rtol=5e-3)


def test_every_example_has_a_test():
    tested = {
        node.args[0].value
        for node in ast.walk(ast.parse(Path(__file__).read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "run"
    }
    assert sorted(tested) == NAMES


def test_a_block_between_rough_platens_goes_to_its_limit_load(run):
    plateau, limit, _ = run("limit_load", elements=4, increments=10)
    # Fully integrated elements come from above, and a march from below.
    assert 2.42766 < plateau < limit.multiple < 1.09 * 2.42766


def test_a_punch_goes_where_its_force_takes_it(run):
    force, sunk = np.array(run("punch", increments=6)).T
    assert force.max() == pytest.approx(2200.0, rel=1e-7)
    assert force[-1] == pytest.approx(2200.0, rel=1e-7)
    first = int(np.argmax(force > 2199.0))
    least = first + int(np.argmin(force[first:]))
    assert force[least] == pytest.approx(440.0, rel=1e-7)
    # What is taken off and put on again springs back and returns.
    assert 0.9 * sunk[first] < sunk[least] < sunk[first] <= sunk[-1] < 1.05 * sunk[first]


@pytest.mark.slow
def test_a_wedge_goes_in_by_the_known_force(run):
    depth, force = np.array(run("wedge_indentation", increments=24, elements=10)[0]).T
    assert depth[-1] == pytest.approx(1.0)
    assert np.mean(force[depth > 0.5]) == pytest.approx(24.7662, rel=0.05)


@pytest.mark.slow
def test_a_billet_is_extruded_by_about_the_known_pressure(run):
    punch, dies = run("extrusion", increments=18, elements=6)[0].T
    np.testing.assert_allclose(dies, punch, rtol=1e-6)
    assert np.mean(punch[len(punch) // 2 :]) == pytest.approx(0.761799, rel=0.1)


@pytest.mark.slow
def test_the_stress_that_draws_a_bar_is_between_its_bounds(run):
    found = run("bar_drawing", increments=20, elements=5, shear=(0.0, 0.1))
    assert np.log(1 / 0.7) < found[0.0] < 0.56059
    assert found[0.0] < found[0.1] < 0.63744


def test_a_punch_that_gives_way_presses_a_little_less(run):
    rows, _ = run("elastic_punch", travel=0.2, elements=4)
    (_, rigid, none), (_, hard, shallow), (_, soft, deep) = rows
    assert none == 0 < shallow < deep
    assert 0.99 * rigid < soft < hard < rigid


def test_a_roller_goes_half_as_far_as_the_plate_on_it(run):
    *_, last = run("roller", travel=0.6, elements=4, increments=5)
    mesh = last.solved.iterate.increment.system.body.scene.mesh
    moved = (last.state.nodes - mesh.nodes)[np.unique(mesh.elements[mesh.region("roller")])]
    assert moved[:, 0].mean() == pytest.approx(0.3, rel=2e-3)
    along, across = last.tool_force(1)
    # A round roller would bear none; on four elements a side its edges leave up to a quarter of mu.
    assert abs(along) < 0.25 * 0.3 * abs(across)
    np.testing.assert_allclose(last.tool_force(0), -last.tool_force(1), atol=1e-5 * abs(across))
