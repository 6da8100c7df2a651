"""What bodies in space cost: benchmarks in short, the block as a deck of CalculiX, memory at many contacts."""

from __future__ import annotations

import csv
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from benchmarks import space
from benchmarks.rows import write
from bipot.fem.assembly import rigid_motions
from bipot.fem.reduction import Geometry
from bipot.forms import Newton
from bipot.forms.base import Cache
from bipot.increment import Increment
from bipot.marching import system_of
from bipot.meshes.elements import Element
from bipot.meshes.solids import brick
from studies.accuracy import block_total, calculix
from studies.accuracy.block_alone import scene_of
from studies.accuracy.block_deck import BlockDeck
from studies.accuracy.deck import FACES, NODES

INSTALLED = pytest.mark.skipif(calculix.executable() is None, reason=calculix.ABSENT)
DECK = BlockDeck(0.1, "C3D8I", FACES, 2, 0.05, 10.0, 0.1)


@pytest.mark.slow
def test_the_benchmark_writes_its_table(tmp_path, capsys):
    assert space.main(["--fast", "--sizes", "3", "--out", str(tmp_path)]) == 0
    with (tmp_path / "space.csv").open(newline="", encoding="utf-8") as file:
        (found,) = csv.DictReader(file)
    assert (found["elements"], found["fallbacks"]) == ("3", "0")
    assert float(found["passes_an_increment"]) <= 5
    assert float(found["peak_MB"]) < 2000
    assert "3 a side" in capsys.readouterr().out


def row(**changed):
    """A row that meets every limit."""
    blank = space.Row(0.1, 0.3, "tensor", 16, 10, 5, 100, 30, 2.0, 0, 1.0, 0.8, 0.5, 0.5, 10.0, 900.0)
    return replace(blank, **changed)


@pytest.mark.parametrize("missed", [{"pass_over_kappa": 1.4}, {"passes_an_increment": 5.5}, {"peak_MB": 2100.0}])
def test_a_limit_that_is_missed_ends_with_one(missed, monkeypatch, tmp_path):
    class Alone:
        def submit(self, job, mu, size, *path):
            return self

        def result(self):
            return found

    class Pool:
        def __enter__(self):
            return Alone()

        def __exit__(self, *of):
            return None

    monkeypatch.setattr(space, "processes", lambda count: Pool())
    asked = ["--sizes", "16", "--mu", "0.1", "--out", str(tmp_path)]
    found = row()
    assert space.main(asked) == 0
    found = row(**missed)
    assert space.main(asked) == 1


def test_growth_is_the_exponent_over_the_unknowns(tmp_path):
    coarse, fine = row(unknowns=10, pass_s=1.0, factorisation_s=1.0), row(unknowns=100, pass_s=10.0)
    found = space.grown(replace(fine, factorisation_s=100.0), coarse)
    assert (found.time_growth, found.factorisation_growth) == pytest.approx((1.0, 2.0))
    write(tmp_path / "space.csv", space.Row, [found])


def test_rigid_motions_ask_for_no_more_memory_than_what_is_held():
    nodes = brick(1.0, 1.0, 1.0, 25, 25, 25).nodes
    free = np.flatnonzero(np.repeat(nodes[:, 2] > 0.5, 3))
    tracemalloc.start()
    motions = rigid_motions(nodes, free, Geometry.SOLID)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert motions.shape[1] == 0
    held = nodes.size - len(free)
    assert peak < 8 * held**2 / 20


@pytest.mark.slow
def test_newton_has_nothing_dense_in_the_contacts():
    """Of a thin plate, whose contacts are half of all nodes: arrays of one pass against a matrix of the contacts."""
    scene, n = scene_of(0.3, 1, 0.3), 50
    platen = replace(scene.tools[0], point=(0.0, 0.0, 1.0), travel=(0.0, 0.0, -0.01))
    scene = replace(scene, mesh=brick(25.0, 25.0, 1.0, n, n, 1), tools=(platen,))
    system = system_of(scene)
    count, form, cache = len(system.candidates.node), Newton(), Cache()
    assert count > n**2
    iterate = Increment(system, system.rest(), 0.01).at(np.zeros(system.body.space.size))
    state = form.init(iterate, iterate.increment.start.forces, cache)
    tracemalloc.start()
    form.step(iterate, iterate.increment.start.forces, state)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8 * (3 * count) ** 2 / 4


def cards(text, word):
    """The lines below each card of this word."""
    blocks = ["".join(part) for part in text.split("*")]
    return [block.splitlines()[1:] for block in blocks if block.split(",")[0].split("\n")[0] == word]


def test_a_deck_holds_the_planes_of_symmetry_and_drives_the_platen():
    text = DECK.text((0.1, 0.3))
    assert cards(text, "BOUNDARY")[0] == ["LEFT, 1, 1", "FRONT, 2, 2", "BASE, 3, 3", "PUNCH, 1, 2"]
    assert [lines[0] for lines in cards(text, "BOUNDARY")[1:]] == ["PUNCH, 3, 3, -0.5", "PUNCH, 3, 3, -1.5"]


def test_its_faces_in_contact_are_those_of_the_top_and_of_the_upper_sides():
    slave = cards(DECK.text((0.1,)), "SURFACE")[0]
    assert sorted(slave) == sorted(
        [*(f"{e}, S2" for e in (5, 6, 7, 8)), *(f"{e}, S4" for e in (7, 8)), *(f"{e}, S5" for e in (6, 8))]
    )
    nodes = cards(replace(DECK, contact=NODES).text((0.1,)), "SURFACE")[0]
    assert len(nodes) == 9 + 5


def test_lines_of_a_quadratic_brick_go_on_after_sixteen_entries():
    deck = replace(DECK, element="C3D20R", elements=1)
    assert deck.mesh().element is Element.H20
    first, second = cards(deck.text((0.1,)), "ELEMENT")[0]
    assert (first.count(","), first[-1]) == (16, ",")
    assert len(second.split(",")) == 21 - 16


@INSTALLED
@pytest.mark.parametrize(("element", "contact"), [("C3D8I", NODES), ("C3D8I", FACES), ("C3D20R", FACES)])
def test_calculix_has_the_exact_force_without_friction(element, contact):
    """To the softness of its contact. At nodes of quadratic faces it has not, whose corners would have to pull."""
    deck = BlockDeck(0.0, element, contact, 2, 0.05, 10.0, 0.1)
    found = calculix.calculated(deck, (0.3,), str(calculix.executable()))
    assert found.stopped == ""
    assert found.forces[-1] == pytest.approx(300.0 * 100.0 / 0.7, rel=2e-3)


@pytest.mark.slow
@INSTALLED
def test_the_block_beside_calculix(tmp_path):
    assert block_total.main(["--fast", "--out", str(tmp_path)]) == 0
    with (tmp_path / "block_total.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["program"] for row in rows} == {"bipot", "CalculiX"}
    assert all(float(row["force_error"]) < 0.02 for row in rows)
    assert (tmp_path / "block_ratio.csv").exists()
