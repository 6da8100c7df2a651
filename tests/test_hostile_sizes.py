"""Sizes and numbers that cannot be meant, or do not fit, end in a sentence: at once, and before memory is asked for."""

import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from benchmarks import memory as memory_benchmark
from benchmarks import paired, speed
from bipot import (
    Control,
    Element,
    Newton,
    Perfect,
    SceneError,
    Schedule,
    Tabulated,
    block,
    brick,
    cylinder,
    cylinder_3d,
    march,
    ring,
    ring_3d,
    upsetting,
)
from bipot.meshes import cells
from bipot.meshes.elements import elements_of
from studies import convergence, coulomb_profiles, hard_cases, landings, penalty_vs_conic
from studies.fuzz import __main__ as fuzz
from studies.fuzz import tasks
from studies.fuzz.row import Table

ROOT = Path(__file__).parents[1]
HUGE = 10**5
MANY = 10**5000
"""Python does not even print it."""
SMALL = 1_500_000_000
"""Bytes of address space in which a study starts, and nothing large is allocated."""


def len_of(number):
    """A name for a number that may not be printed."""
    return f"{type(number).__name__} of {int(number).bit_length()} bits"


MAKERS = {
    "cylinder": lambda n, m, element: cylinder(1.0, 1.0, n, m, element=element),
    "block": lambda n, m, element: block(1.0, 1.0, n, m, element=element),
    "ring": lambda n, m, element: ring(1.0, 2.0, 1.0, n, m, element=element),
}


@pytest.mark.parametrize(
    "make",
    [
        lambda: block(64321.088860373195, 0.06432108886037319, 1, 1),
        lambda: ring(1000.0, 1000.001, 1000.0, 1, 1),
        lambda: ring_3d(1000.0, 1000.001, 1000.0, 2, 1, 1),
    ],
    ids=["sheet", "tube", "tube in space"],
)
def test_a_side_a_million_times_another_is_taken_whatever_its_round_off(make):
    assert np.ptp(make().nodes, axis=0).max() > 0


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
@pytest.mark.parametrize("element", elements_of(2))
def test_a_mesh_that_memory_has_no_room_for_is_refused_by_name(make, element):
    with pytest.raises(SceneError, match=r"n_[rx] = 100000: must be so few .* about \S+ GB"):
        make(HUGE, HUGE, element)
    with pytest.raises(SceneError, match=r"n_[yz] = 1000000000000"):
        make(1, np.int64(10**12), element)


BODIES = {
    "upsetting": (partial(upsetting, mu=0.1), {"height": 10.0, "diameter": 10.0}),
    "cylinder": (partial(cylinder, n_r=1, n_z=1), {"radius": 1.0, "height": 1.0}),
    "block": (partial(block, n_x=1, n_y=1), {"width": 1.0, "height": 1.0}),
    "brick": (partial(brick, n_x=1, n_y=1, n_z=1), {"width": 1.0, "depth": 1.0, "height": 1.0}),
    "cylinder_3d": (partial(cylinder_3d, n_square=1, n_r=1, n_z=1), {"radius": 1.0, "height": 1.0}),
}
RINGS = {"ring": partial(ring, n_r=1, n_z=1), "ring_3d": partial(ring_3d, n_around=1, n_r=1, n_z=1)}


@pytest.mark.parametrize(("make", "sides"), BODIES.values(), ids=BODIES)
def test_a_side_beyond_all_others_is_refused_by_name(make, sides):
    """A height of 2^63 once gave a mesh whose Jacobians were not positive, and the message told that."""
    for field, length in sides.items():
        other = next(name for name in sides if name != field)
        with pytest.raises(SceneError, match=rf"^{field} = 9.22\S*e\+18: must be at most 1e\+06 times"):
            make(**sides | {field: 2**63})
        with pytest.raises(SceneError, match=rf"^{other} = .*: must be at most 1e\+06 times {field} = "):
            make(**sides | {field: 0.99e-6 * length})
        with pytest.raises(SceneError, match=rf"^{field} = 1e-41: must be of a magnitude from 1e-40 to 1e\+40"):
            make(**sides | {field: 1e-41})
        make(**sides | {field: 1e6 * length})
        make(**sides | {field: np.float32(length)})


@pytest.mark.parametrize("make", RINGS.values(), ids=RINGS)
def test_a_ring_much_wider_or_higher_than_its_other_side_is_refused_by_name(make):
    with pytest.raises(SceneError, match=r"^outer - inner = .*: must be at most 1e\+06 times height = 1$"):
        make(inner=1.0, outer=2**63, height=1.0)
    with pytest.raises(SceneError, match=r"^height = 9.22\S*e\+18: must be at most 1e\+06 times outer - inner"):
        make(inner=1.0, outer=2.0, height=2**63)


@pytest.mark.parametrize("count", [10**13, 10**18, np.int64(2**62), MANY, -MANY, 10**30], ids=len_of)
def test_huge_counts_are_refused_in_few_words(count):
    for make in (
        lambda n: upsetting(mu=0.1, elements=n),
        lambda n: block(1.0, 1.0, n, 1, element=Element.Q8),
        Schedule,
    ):
        with pytest.raises(SceneError) as refused:
            make(count)
        assert len(str(refused.value)) < 250


@pytest.mark.slow
def test_the_memory_that_is_said_is_near_what_a_march_takes():
    """On 40 x 40, in a process of its own; within a factor of two."""
    with_imports, _ = memory_benchmark.measured(2, 3)
    peak, _ = memory_benchmark.measured(40, 3)
    nodes = len(upsetting(mu=0.1, elements=40).mesh.nodes)
    assert 0.5 < cells.BYTES_A_NODE * nodes / (1e9 * (peak - with_imports)) < 2


def test_what_fits_is_not_refused_and_what_does_not_is_by_a_machine_that_says_nothing(monkeypatch):
    monkeypatch.setattr(cells, "memory", lambda: 3 * 10 * 10 * cells.BYTES_A_NODE)
    assert len(upsetting(mu=0.1, elements=10).mesh.elements) == 100
    with pytest.raises(SceneError, match=r"elements = 11: must be so few that they fit into the 0\.006 GB of memory"):
        upsetting(mu=0.1, elements=11)
    monkeypatch.setattr(cells, "memory", lambda: None)
    assert len(upsetting(mu=0.1, elements=11).mesh.elements) == 121


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"increments": 10**9}, "increments = 1000000000: must be <= 1000000"),
        ({"increments": MANY}, "increments = 'a number of many digits': must be <= 1000000"),
        ({"increments": 1, "settling": 10**9, "first": 1e-10}, "settling = 1000000000"),
        ({"increments": 1, "first": 1e-9, "growth": 1 + 1e-15}, "growth = 1.000000000000001: must be such that"),
        ({"increments": float("nan")}, "increments = nan"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_schedule_of_more_pseudo_times_than_can_be_meant_is_refused(asked, words):
    with pytest.raises(SceneError, match=words):
        Schedule(**asked)


@pytest.mark.parametrize("tau", [float("nan"), float("inf"), -1e-9, 1.0000001])
def test_a_start_at_a_time_that_is_none_is_refused(tau):
    scene = upsetting(mu=0.1, elements=1)
    begun = next(march(scene, Schedule(5, 0.001), Control(Newton(), ()))).state
    with pytest.raises(SceneError, match=r"start\.tau = "):
        next(march(scene, Schedule(5), Control(Newton(), ()), replace(begun, tau=tau)))


@pytest.mark.parametrize("value", [1e300, 1e-300, float("nan"), float("inf"), -1.0, 0.0])
def test_a_yield_stress_that_is_none_is_refused(value):
    for make in (Perfect, lambda stress: Tabulated((0.0, 0.1), (stress, stress))):
        with pytest.raises(SceneError, match=r"sigma_y|stress"):
            make(value)
        with pytest.raises(SceneError, match="'a number of many digits'"):
            make(MANY)


LINES = [
    (convergence, ["--mu", "nan"], "--mu: nan: must be a number >= 0"),
    (convergence, ["--mu", "-1"], "--mu: -1: must be"),
    (convergence, ["--mu", "1e13", "--fast"], "mu = 10000000000000.0: must be >= 0, to 1e+12"),
    (landings, ["--elements", "0"], "--elements: 0: must be >= 1"),
    (landings, ["--elements", "1e3"], "--elements: 1e3: must be a whole number"),
    (landings, ["--elements", "100000"], "elements = 100000: must be so few that they fit into"),
    (landings, ["--elements", "9" * 5000], "(5000 characters): must be a whole number"),
    (hard_cases, ["--increments", "-1"], "--increments: -1: must be >= 1"),
    (hard_cases, ["--elements", "nan"], "--elements: nan: must be a whole number"),
    (fuzz, ["--seed", "-1"], "--seed: -1: must be >= 0"),
    (fuzz, ["--scenes", "inf"], "--scenes: inf: must be a whole number"),
    (fuzz, ["--coulomb", "-5"], "--coulomb: -5: must be >= 0"),
    (fuzz, ["--jobs", "1000000000"], "--jobs: 1000000000: must be from 1 to"),
    (penalty_vs_conic, ["--workers", "-1"], "--workers: -1: must be from 0 to"),
    (coulomb_profiles, ["--workers", "1000000"], "--workers: 1000000: must be from 0 to"),
    (coulomb_profiles, ["--limit", "nan"], "--limit: nan: must be a finite number > 0"),
    (coulomb_profiles, ["--limit", "-1"], "--limit: -1: must be a finite number > 0"),
    (coulomb_profiles, ["--tol", "inf"], "--tol: inf: must be a finite number > 0"),
    (coulomb_profiles, ["--tol", "0"], "--tol: 0: must be a finite number > 0"),
    (coulomb_profiles, ["--require", "1", "2", "x", "4"], "--require: x: must be a whole number"),
    (memory_benchmark, ["--elements", "0"], "--elements: 0: must be >= 1"),
    (memory_benchmark, ["--elements", "100000"], "elements = 100000: must be so few"),
    (memory_benchmark, ["--increments", "1000000000"], "--increments: 1000000000: must be from 2 to"),
    (speed, ["--sizes", "0"], "--sizes: 0: must be >= 1"),
    (speed, ["--mu", "nan"], "--mu: nan: must be"),
    (paired, ["HEAD", "--pairs", "0"], "--pairs: 0: must be >= 1"),
]


@pytest.mark.parametrize(("study", "asked", "words"), LINES, ids=[words for _, _, words in LINES])
def test_numbers_that_cannot_be_meant_are_refused_with_the_range(study, asked, words, tmp_path, capsys):
    more = [] if study is memory_benchmark else ["--out", str(tmp_path)]
    try:
        code = study.main([*asked, *more])
    except SystemExit as stop:
        code = stop.code
    said = capsys.readouterr().err.splitlines()
    assert code == 2
    assert words in said[-1]
    assert len(said[-1]) < 400
    assert not list(tmp_path.iterdir())


def in_little_memory(*command):
    """What a command says in an address space of little size."""
    code = "import resource, runpy, sys; resource.setrlimit(resource.RLIMIT_AS, ({0}, {0})); ".format(4 * SMALL)
    code += f"sys.argv = sys.argv[1:]; runpy.run_module({command[0]!r}, run_name='__main__', alter_sys=True)"
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, command)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=100,
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("asked", "words"),
    [
        (["--elements", 100000], "elements = 100000: must be so few that they fit into the"),
        (["--increments", 10**9], "increments = 1000000000: must be <= 1000000"),
        (["--increments", 10**24], "must be <= 1000000"),
        (["--hardening", "perfect:1e300"], "sigma_y = 1e+300: must be of a magnitude"),
        (["--hardening", "perfect:" + "9" * 5000], "sigma_y = inf"),
    ],
)
def test_the_upsetting_says_what_does_not_fit_before_it_asks_for_memory(asked, words, tmp_path):
    ended = in_little_memory("studies.upsetting", *asked, "--out", tmp_path / "out")
    assert (ended.returncode, ended.stderr.count("\n"), ended.stdout) == (2, 1, "")
    assert words in ended.stderr


def test_any_number_of_scenes_may_be_asked_for(tmp_path):
    """They are made as they are needed."""
    taken = tasks.tasks(7, {"scene": 10**12, "coulomb": 10**30})
    assert [next(taken) for _ in range(3)] == [("scene", 7), ("scene", 8), ("scene", 9)]
    table = Table(tmp_path / "fuzz.csv")
    assert table.has(0, {"scene": 10**30, "coulomb": 10**12}) == 0


@pytest.mark.parametrize("name", ["x" * 300, "a/" + "b" * 256 + "/c"])
def test_a_name_that_no_file_system_knows_is_a_sentence(name, tmp_path, capsys):
    assert landings.main(["--fast", "--out", f"{tmp_path}/{name}"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ")
    assert said.count("\n") == 1


def test_a_long_row_of_elements_is_not_taken_for_a_square():
    assert len(block(1.0, 1e-3, 2000, 1, element=Element.Q8).elements) == 2000
