"""The deformable die beside CalculiX: its deck, a fast run, and what is kept of a whole one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bipot import Control, FlatTool, Newton, Schedule, march, upsetting
from studies.accuracy import die
from studies.accuracy.calculix import ABSENT, executable
from studies.accuracy.deck import NODES
from studies.accuracy.die import DIE, MARKS, RADIUS, SIZE, STUDY, DieDeck, die_of, scene_of
from studies.accuracy.foreign import MOST, Row, key
from studies.tables import read_rows

KEPT = Path(__file__).parents[1] / "docs" / "results"
INSTALLED = pytest.mark.skipif(executable() is None, reason=ABSENT)
DECK = DieDeck(0.3, "CAX8R", NODES, 3, 0.02, 10.0, 0.1)


def after(lines, head):
    """Numbers of each line of data below a head."""
    rest = lines[lines.index(head) + 1 :]
    last = next((k for k, line in enumerate(rest) if line.startswith("*")), len(rest))
    return [[word.strip() for word in line.strip(", ").split(",")] for line in rest[:last]]


def test_the_deck_has_the_meshes_of_the_scene():
    """The die's nodes follow those of the cylinder, and it is elastic; what is moved is its top."""
    lines, scene = DECK.text(MARKS).splitlines(), scene_of(0.3, 3)
    places = np.array(
        [row[1:3] for head in ("*NODE, NSET=BODY", "*NODE, NSET=DIE") for row in after(lines, head)], dtype=float
    )
    np.testing.assert_allclose(places, scene.mesh.nodes)
    assert lines[lines.index("*MATERIAL, NAME=TOOL") + 2] == f"{DIE.elasticity.young:g}, {DIE.elasticity.poisson:g}"
    moved = np.array([row[0] for row in after(lines, "*NSET, NSET=PUNCH")], dtype=int) - 1
    np.testing.assert_allclose(places[moved, 1], places[:, 1].max())
    assert np.ptp(places[moved, 0]) == RADIUS
    elements = [row[1:] for row in after(lines, "*ELEMENT, TYPE=CAX8R, ELSET=TOOL")]
    np.testing.assert_array_equal(np.array(elements, dtype=int) - 1, scene.mesh.elements[scene.mesh.region("die")])


def test_the_master_is_the_lower_face_of_the_die():
    lines = DECK.text(MARKS).splitlines()
    faces, mesh = after(lines, "*SURFACE, NAME=MASTER"), scene_of(0.3, 3).mesh
    assert len(faces) == len(die_of(3).boundaries["base"])
    for number, side in faces:
        k = int(side[1])
        ends = mesh.elements[int(number) - 1, [k - 1, k % 4]]
        np.testing.assert_allclose(mesh.nodes[ends, 1], SIZE)


def test_no_node_of_the_cylinder_is_before_one_of_the_die_but_on_the_axis():
    for _, elements in STUDY.whole.runs:
        mesh = scene_of(0.0, elements).mesh
        top, base = (np.unique(mesh.boundaries[name]) for name in ("cylinder/top", "die/base"))
        assert np.intersect1d(*(np.round(mesh.nodes[of, 0], 9) for of in (top, base))).tolist() == [0.0]


def test_the_die_is_dented():
    """A rigid one that goes as far is pressed by more than five times what the programs differ by."""
    soft = scene_of(0.1, 3, MARKS[-1])
    flat = FlatTool((0.0, SIZE), (0.0, -1.0), (0.0, -MARKS[-1] * SIZE), ("top", "side"), 0.1)
    hard = replace(upsetting(mu=0.1, elements=3), material=soft.material, quadrature=soft.quadrature, tools=(flat,))
    forces = []
    for scene in (hard, soft):
        *_, last = march(scene, Schedule(accuracy=1e-3), Control(Newton(), ()))
        forces.append(last.tool_force(0)[1])
    rows = read_rows(KEPT / "die.csv", Row)
    assert forces[0] / forces[1] - 1 > 5 * max(abs(row.difference) for row in rows)


@INSTALLED
def test_the_fast_study_has_the_foreign_force(tmp_path):
    assert die.main(["--fast", "--out", str(tmp_path)]) == 0
    rows = read_rows(tmp_path / "die.csv", Row)
    assert [key(row) for row in rows] == STUDY.fast.keys
    for row in rows:
        assert row.difference == row.own_force_N / row.foreign_force_N - 1
        assert abs(row.difference) < MOST
        assert min(row.own_s, row.foreign_s) > 0


def test_the_kept_forces_are_as_the_page_says():
    """At mu = 0.3 CalculiX stops on the finer mesh; both programs have the same force at all other marks."""
    rows = read_rows(KEPT / "die.csv", Row)
    reached = [row for row in STUDY.whole.keys if row != (0.3, 10, MARKS[-1])]
    assert [key(row) for row in rows] == reached
    assert max(abs(row.difference) for row in rows) <= MOST
