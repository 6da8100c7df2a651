"""Deformable dies beside CalculiX: their decks, fast runs, and what is kept of whole ones."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bipot import Control, FlatTool, Newton, Schedule, march, upsetting
from studies.accuracy import block_die, die
from studies.accuracy.block_deck import SIDES
from studies.accuracy.calculix import ABSENT, executable
from studies.accuracy.deck import FACES, NODES
from studies.accuracy.die import DIE, MARKS, RADIUS, SIZE
from studies.accuracy.foreign import MOST, Row, key
from studies.tables import read_rows

KEPT = Path(__file__).parents[1] / "docs" / "results"
INSTALLED = pytest.mark.skipif(executable() is None, reason=ABSENT)
DECKS = {
    die: die.DieDeck(0.3, "CAX8R", NODES, 3, 0.02, 10.0, 0.1),
    block_die: block_die.BlockDieDeck(0.3, "C3D20R", FACES, 3, 0.02, 10.0, 0.1),
}
EDGES = [(k, (k + 1) % 4) for k in range(4)]
ALL = pytest.mark.parametrize(
    ("study", "body", "width", "sides"),
    [(die, "cylinder", RADIUS, EDGES), (block_die, "cube", block_die.WIDTH, SIDES)],
    ids=["die", "block_die"],
)


def after(lines, head):
    """Numbers of each line of data below a head; a line that ends with a comma goes on in the next."""
    rest = lines[lines.index(head) + 1 :]
    last = next((k for k, line in enumerate(rest) if line.startswith("*")), len(rest))
    joined = "\n".join(rest[:last])
    # One entry a line ends with a comma, too.
    if "ELEMENT" in head:
        joined = joined.replace(",\n", ", ")
    return [[word.strip() for word in line.strip(", ").split(",")] for line in joined.split("\n")]


@ALL
def test_the_deck_has_the_meshes_of_the_scene(study, body, width, sides):
    """The die's nodes follow those of the body, and it is elastic; what is moved is its top."""
    deck, scene = DECKS[study], study.scene_of(0.3, 3)
    lines, d = deck.text(MARKS).splitlines(), scene.mesh.dimension
    places = np.array(
        [row[1 : d + 1] for head in ("*NODE, NSET=BODY", "*NODE, NSET=DIE") for row in after(lines, head)], dtype=float
    )
    np.testing.assert_allclose(places, scene.mesh.nodes)
    assert lines[lines.index("*MATERIAL, NAME=TOOL") + 2] == f"{DIE.elasticity.young:g}, {DIE.elasticity.poisson:g}"
    moved = np.array([row[0] for row in after(lines, "*NSET, NSET=PUNCH")], dtype=int) - 1
    np.testing.assert_allclose(places[moved, -1], places[:, -1].max())
    assert np.ptp(places[moved, 0]) == width
    elements = [row[1:] for row in after(lines, f"*ELEMENT, TYPE={deck.element}, ELSET=TOOL")]
    np.testing.assert_array_equal(np.array(elements, dtype=int) - 1, scene.mesh.elements[scene.mesh.region("die")])


@ALL
def test_the_master_is_the_lower_face_of_the_die(study, body, width, sides):
    lines = DECKS[study].text(MARKS).splitlines()
    faces, mesh = after(lines, "*SURFACE, NAME=MASTER"), study.scene_of(0.3, 3).mesh
    assert len(faces) == len(study.die_of(3).boundaries["base"])
    for number, side in faces:
        ends = mesh.elements[int(number) - 1, list(sides[int(side[1]) - 1])]
        np.testing.assert_allclose(mesh.nodes[ends, -1], SIZE)


@ALL
def test_no_node_of_the_body_is_before_one_of_the_die_but_in_planes_of_symmetry(study, body, width, sides):
    for _, elements in study.STUDY.whole.runs:
        mesh = study.scene_of(0.0, elements).mesh
        top, base = (np.unique(mesh.boundaries[name]) for name in (f"{body}/top", "die/base"))
        for axis in range(mesh.dimension - 1):
            places = (np.round(mesh.nodes[of, axis], 9) for of in (top, base))
            assert np.intersect1d(*places).tolist() == [0.0]


def test_the_die_is_dented():
    """A rigid one that goes as far is pressed by more than five times what the programs differ by."""
    soft = die.scene_of(0.1, 3, MARKS[-1])
    flat = FlatTool((0.0, SIZE), (0.0, -1.0), (0.0, -MARKS[-1] * SIZE), ("top", "side"), 0.1)
    hard = replace(upsetting(mu=0.1, elements=3), material=soft.material, quadrature=soft.quadrature, tools=(flat,))
    forces = []
    for scene in (hard, soft):
        *_, last = march(scene, Schedule(accuracy=1e-3), Control(Newton(), ()))
        forces.append(last.tool_force(0)[1])
    rows = read_rows(KEPT / "die.csv", Row)
    assert forces[0] / forces[1] - 1 > 5 * max(abs(row.difference) for row in rows)


@INSTALLED
@pytest.mark.parametrize("study", [die, pytest.param(block_die, marks=pytest.mark.slow)], ids=["die", "block_die"])
def test_the_fast_study_has_the_foreign_force(study, tmp_path):
    assert study.main(["--fast", "--out", str(tmp_path)]) == 0
    rows = read_rows(tmp_path / f"{study.STUDY.name}.csv", Row)
    assert [key(row) for row in rows] == study.STUDY.fast.keys
    for row in rows:
        assert row.difference == row.own_force_N / row.foreign_force_N - 1
        assert abs(row.difference) < MOST
        assert min(row.own_s, row.foreign_s) > 0


@pytest.mark.parametrize(("study", "stops"), [(die, [(0.3, 10, MARKS[-1])]), (block_die, [])], ids=["die", "block_die"])
def test_the_kept_forces_are_as_the_page_says(study, stops):
    """Before a mark of those where it ``stops`` CalculiX does; both programs have the same force at all others."""
    rows = read_rows(KEPT / f"{study.STUDY.name}.csv", Row)
    assert [key(row) for row in rows] == [row for row in study.STUDY.whole.keys if row not in stops]
    assert max(abs(row.difference) for row in rows) <= MOST
