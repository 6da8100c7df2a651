"""Command lines: no abbreviated options, none without effect, and the route of the programs is said."""

import ast
from pathlib import Path

import numpy as np
import pytest

from benchmarks import writing
from bipot import Elasticity, Perfect, Tabulated, VonMises
from bipot import upsetting as upsetting_scene
from bipot.forms import FormName
from bipot.results import open as open_results
from studies import block, coulomb_profiles, hard_cases, sweep, upsetting
from studies.accuracy import alone, block_alone
from studies.outputs import parser_of
from studies.upsetting_case import cases, parser

ROOT = Path(__file__).parents[1]
SCRIPTS = [path for folder in ("studies", "benchmarks", "paper_figs") for path in sorted((ROOT / folder).glob("*.py"))]
SMALL = ["--elements", "2", "--increments", "2", "--reduction", "0.05", "--mu", "0"]


def parsers():
    """Every parser made in a script: its path and the keywords of the call."""
    for path in SCRIPTS:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("ArgumentParser"):
                yield path.name, {keyword.arg: ast.unparse(keyword.value) for keyword in node.keywords}


@pytest.mark.parametrize("main", [writing.main, alone.main, block_alone.main])
def test_a_command_line_that_is_none_runs_nothing(main, capsys):
    """The benchmark ran whatever was asked, the others ended in a traceback."""
    for asked, code in (["--help"], 0), (["--nope"], 2):
        with pytest.raises(SystemExit) as stop:
            main(asked)
        assert stop.value.code == code
    told = capsys.readouterr()
    assert told.out.startswith("usage: ")
    assert "error: " in told.err


@pytest.mark.parametrize("main", [alone.main, block_alone.main])
@pytest.mark.parametrize("job", ["x", "{}", "3", '[{"mu": 0.1}]', "[]"])
def test_a_job_that_is_none_is_refused(main, job, capsys):
    with pytest.raises(SystemExit) as stop:
        main([job])
    assert stop.value.code == 2
    assert f"argument JOB: {job!r} must be a choice and marks, as JSON" in capsys.readouterr().err


def test_no_command_line_takes_abbreviations():
    made = list(parsers())
    assert len(made) > 15
    assert not [name for name, keywords in made if keywords.get("allow_abbrev") != "False"]


@pytest.mark.parametrize("option", ["--element", "--redu", "--form=tangent --increment"])
def test_an_abbreviated_option_is_unknown(option, capsys):
    with pytest.raises(SystemExit) as stop:
        upsetting.main([*option.split(), "3"])
    assert stop.value.code == 2
    assert "unrecognized arguments" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--kn", "1e5"], "--kn has no effect on --form tangent as asked: it needs --form penalty or uzawa"),
        (["--form", "newton", "--kt", "1e5"], "--kt has no effect on --form newton"),
        (["--form", "newton", "--solver", "qoco"], "--solver has no effect on --form newton"),
        (["--form", "penalty", "--solver", "clarabel"], "it needs --form tangent or dissipation"),
        (["--form", "delassus", "--solver", "qoco"], "--solver has no effect"),
        (["--fast"], "--fast has no effect on --form tangent as asked: it needs --elements or --increments left to it"),
        (["--sigma-Y", "250", "--hardening", "perfect:300"], "--sigma-Y has no effect on --form tangent as asked"),
        (["--height", "0"], "height = 0.0: must be"),
        (["--diameter", "nan"], "diameter = nan: must be"),
        (["--E", "-1"], "young = -1.0: must be"),
        (["--nu", "0.5"], "poisson = 0.5: must be"),
        (["--sigma-Y", "-3"], "sigma_y = -3.0: must be"),
        (["--hardening", "csv:"], "hardening = 'csv:': must be csv:FILE, of two columns"),
        (["--hardening", "csv:nowhere.csv"], "nowhere.csv: cannot be read as text"),
        (["--mu", "0.3", "0.30"], "--mu = [0.3, 0.3]: must be different"),
        (["--mu", "inf", "--form", "uzawa"], "--mu = 'inf': must be finite: uzawa does not weld"),
        (["--mu", "inf", "--form", "delassus"], "--mu = 'inf': must be finite: delassus does not weld"),
        (["--solver", "scs"], "--solver = 'scs': must be one of clarabel, qoco, or cvxpy:NAME"),
        (["--solver", "cvxpy:nobody"], "--solver = 'cvxpy:nobody': must be cvxpy: and one of"),
        (["--mu", "inf", "--fclib"], "--mu = 'inf': must be finite with --fclib"),
    ],
)
def test_an_option_without_effect_is_refused(arguments, words, tmp_path, capsys):
    assert upsetting.main([*SMALL, "--out", str(tmp_path), *arguments]) == 2
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_body_and_material_are_those_asked_for(tmp_path):
    table = tmp_path / "steel.csv"
    table.write_text("strain,stress\n0,250\n0.5,400\n")
    asked = ["--height", "30", "--diameter", "20", "--E", "70000", "--nu", "0.33", "--hardening", f"csv:{table}"]
    (case,) = cases(parser().parse_args([*SMALL, *asked]))
    scene = case.scene()
    np.testing.assert_array_equal(scene.mesh.nodes.max(axis=0), [10.0, 15.0])
    assert scene.tools[0].travel == (0.0, -0.05 * 15.0)
    assert scene.material == VonMises(Elasticity(70000.0, 0.33), Tabulated((0.0, 0.5), (250.0, 400.0)))
    assert {"height", "diameter", "young", "poisson", "hardening"} <= case.parameters().keys()
    (other,) = cases(parser().parse_args([*SMALL, "--sigma-Y", "250.125"]))
    assert other.scene().material == VonMises(Elasticity(210e3, 0.3), Perfect(250.125))


def test_the_cylinder_without_options_is_the_papers():
    (case,) = cases(parser().parse_args(["--mu", "0.3"]))
    given, papers = case.scene(), upsetting_scene(mu=0.3)
    assert given.material == papers.material
    assert given.tools == papers.tools
    np.testing.assert_array_equal(given.mesh.nodes, papers.mesh.nodes)


@pytest.mark.parametrize(
    ("arguments", "route"),
    [
        ([], "cvxpy:clarabel"),
        (["--solver", "clarabel"], "clarabel"),
        (["--solver", "qoco"], "qoco"),
        (["--solver", "cvxpy:scs"], "cvxpy:scs"),
        (["--form", "dissipation"], "cvxpy:clarabel"),
        (["--form", "newton"], "direct, fallbacks cvxpy:clarabel"),
        (["--form", "delassus"], "direct, fallbacks cvxpy:clarabel"),
        (["--form", "penalty"], "direct"),
    ],
)
def test_the_solver_is_one_of_the_parameters(arguments, route):
    (case,) = cases(parser().parse_args([*SMALL, *arguments]))
    assert case.parameters()["solver"] == route


def test_the_solver_is_stored_and_the_routes_are_in_the_help(tmp_path, capsys):
    assert upsetting.main([*SMALL, "--out", str(tmp_path)]) == 0
    assert open_results(tmp_path / "mu0").parameters["solver"] == "cvxpy:clarabel"
    with pytest.raises(SystemExit):
        upsetting.main(["--help"])
    told = capsys.readouterr().out
    assert "cvxpy:NAME poses each increment" in told
    assert "clarabel and qoco take the same data without cvxpy" in told


def of_others():
    return parser_of("energy", "How the energy balance closes.")


@pytest.mark.parametrize("made", [parser, block.parser, sweep.parser, coulomb_profiles.parser, of_others])
def test_the_help_says_what_is_done_unless_asked(made):
    """The form of the block, its element and how far it goes were nowhere."""
    silent = [
        action.dest
        for action in made()._actions
        if action.dest not in ("help", "policy") and action.default not in (None, False)
        if "default" not in (action.help or "")
    ]
    assert silent == []


def test_every_form_has_a_case():
    for form in FormName:
        (case,) = cases(parser().parse_args([*SMALL, "--form", form.value]))
        assert case.control().form.name is form


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--elements", "0"], "argument --elements: 0: must be >= 1"),
        (["--increments", "-1"], "argument --increments: -1: must be >= 1"),
        (["--only", "no such case"], "--only 'no such case': no case has that in its name"),
    ],
)
def test_hard_cases_refuse_what_they_once_ignored(arguments, words, tmp_path, capsys):
    """Zero elements ran with the default number, an unknown case ran nothing and passed."""
    with pytest.raises(SystemExit) as stop:
        hard_cases.main([*arguments, "--out", str(tmp_path)])
    assert stop.value.code == 2
    assert words in capsys.readouterr().err
