"""Hardening curves: closed forms and finite differences, and what they refuse."""

import math
import os
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bipot.errors import SceneError
from bipot.laws.hardening import Hardening, Linear, Perfect, Swift, Tabulated, Voce
from bipot.laws.von_mises import Elasticity, VonMises
from studies import hardening_words, upsetting, upsetting_case
from studies.hardening_words import CURVES as BY_NAME
from studies.hardening_words import hardening_from_text, hardening_usage

TABLE = Tabulated((0.0, 0.1, 0.35, 1.0), (300.0, 350.0, 350.0, 800.0))
CURVES: list[Hardening] = [
    Perfect(300.0),
    Linear(300.0, 1000.0),
    Voce(300.0, 100.0, 10.0, 50.0),
    Swift(500.0, 0.02, 0.2),
    TABLE,
]
KINKS = np.array(TABLE.peeq)

quick = settings(deadline=None, derandomize=True, max_examples=60)
# Subnormal strains underflow in the quadrature, not in the curves.
strain = st.floats(0.0, 1.5, allow_subnormal=False)


def test_values_follow_the_formulas():
    p = np.array([0.0, 0.05, 2.0])
    np.testing.assert_array_equal(Perfect(300.0).yield_stress(p), [300.0, 300.0, 300.0])
    np.testing.assert_allclose(Linear(300.0, 1000.0).yield_stress(p), [300.0, 350.0, 2300.0])
    expected = 300.0 + 100.0 * (1.0 - np.exp(-10.0 * p)) + 50.0 * p
    np.testing.assert_allclose(Voce(300.0, 100.0, 10.0, 50.0).yield_stress(p), expected, rtol=1e-15)
    np.testing.assert_allclose(Swift(500.0, 0.02, 0.2).yield_stress(p), 500.0 * (0.02 + p) ** 0.2, rtol=1e-15)
    np.testing.assert_allclose(TABLE.yield_stress(np.array([0.0, 0.05, 0.2, 3.0])), [300.0, 325.0, 350.0, 800.0])


def test_slope_is_the_right_hand_one_at_kinks():
    np.testing.assert_allclose(TABLE.slope(KINKS), [500.0, 0.0, 450.0 / 0.65, 0.0])
    np.testing.assert_allclose(TABLE.slope(np.array([0.0999, 0.3, 5.0])), [500.0, 0.0, 0.0])


@pytest.mark.parametrize("curve", CURVES, ids=lambda c: type(c).__name__)
@given(p=strain)
@quick
def test_slope_matches_finite_differences(curve, p):
    h = 1e-6
    if np.min(np.abs(p - KINKS)) < 2 * h or p < 2 * h:
        p += 4 * h
    difference = (curve.yield_stress(p + h) - curve.yield_stress(p - h)) / (2 * h)
    np.testing.assert_allclose(curve.slope(p), difference, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("curve", CURVES, ids=lambda c: type(c).__name__)
def test_arrays_broadcast(curve):
    p = np.array([[0.0], [0.1]])
    assert curve.yield_stress(p).shape == curve.slope(p).shape == (2, 1)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("perfect:300", Perfect(300.0)),
        ("linear:300,1000", Linear(300.0, 1000.0)),
        ("voce:300,100,10", Voce(300.0, 100.0, 10.0)),
        ("voce:300,100,10,50", Voce(300.0, 100.0, 10.0, 50.0)),
        ("swift:500,0.02,0.2", Swift(500.0, 0.02, 0.2)),
        ("table:0/300,0.1/350,1/400", Tabulated((0.0, 0.1, 1.0), (300.0, 350.0, 400.0))),
    ],
)
def test_text_is_read(text, expected):
    assert hardening_from_text(text) == expected


def test_the_usage_names_the_numbers_of_every_curve():
    assert hardening_usage() == (
        "perfect:sigma_y; linear:sigma_y,modulus; voce:sigma_y,saturation,rate[,modulus]; "
        "swift:strength,offset,exponent; table:peeq/stress,...; csv:FILE"
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("power:300", "hardening = 'power': must be one of csv, linear, perfect, swift, table, voce"),
        ("linear:300", "must be 2 numbers"),
        ("voce:300,1", "must be 3 or 4 numbers"),
        ("perfect:soft", "must be numbers separated by ','"),
        ("table:0/300,0.1", "must be pairs peeq/stress"),
        ("linear:300,-10", "modulus = -10.0: must be finite and >= 0 .softening makes"),
        ("", "must be one of"),
    ],
)
def test_text_is_refused(text, message):
    with pytest.raises(SceneError, match=message):
        hardening_from_text(text)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Perfect(0.0), "sigma_y = 0.0: must be finite and > 0"),
        (lambda: Perfect(float("nan")), "sigma_y = nan"),
        (lambda: Linear(-1.0, 0.0), "sigma_y = -1.0"),
        (lambda: Linear(1.0, float("inf")), "modulus = inf"),
        (lambda: Voce(1.0, -1.0, 1.0), "saturation = -1.0: .*non-convex"),
        (lambda: Voce(1.0, 1.0, 0.0), "rate = 0.0: must be finite and > 0"),
        (lambda: Voce(1.0, 1.0, 1.0, -1.0), "modulus = -1.0: .*non-convex"),
        (lambda: Swift(0.0, 0.1, 0.2), "strength = 0.0: must be finite and > 0"),
        (lambda: Swift(1.0, 0.0, 0.2), "offset = 0.0: must be finite and > 0"),
        (lambda: Swift(1.0, 0.1, -0.2), "exponent = -0.2: must be in .0, 1."),
        (lambda: Swift(1.0, 0.1, 1.1), "exponent = 1.1"),
        (lambda: Swift(1e-50, 1e-20, 1.0), "sigma_y = 1e-70: .*other units"),
        (lambda: Tabulated((0.0,), (1.0,)), "at least two values"),
        (lambda: Tabulated((0.0, 1.0), (1.0,)), "as long as peeq"),
        (lambda: Tabulated((0.1, 1.0), (1.0, 2.0)), "strictly increasing from 0"),
        (lambda: Tabulated((0.0, 0.0), (1.0, 2.0)), "strictly increasing from 0"),
        (lambda: Tabulated((0.0, float("inf")), (1.0, 2.0)), r"peeq\[1\] = inf.*finite"),
        (lambda: Tabulated((0.0, 1.0), (0.0, 2.0)), r"stress\[0\] = 0.0"),
        (lambda: Tabulated((0.0, 1.0), (2.0, 1.0)), r"stress\[1\] = 1.0: .*non-convex"),
        (lambda: Tabulated((0.0, 1e-300), (1.0, 2.0)), r"peeq\[1\] = 1e-300: .*H <= 1e\+60"),
    ],
)
def test_bad_curves_are_refused(make, message):
    with pytest.raises(SceneError, match=message):
        make()


@pytest.mark.parametrize(
    ("text", "delimiter"),
    [
        ("0.0,300\n0.1,350\n1,400\n", ","),
        ("plastic strain, yield stress\n0.0, 300.0\n0.1, 350.0\n1.0, 400.0", ","),
        ('# steel, "annealed"\n\n"p","sigma_Y"\n0,3e2\n# more\n0.1,350 # here\n\n1,400\n', ","),
        ("\ufeffp;MPa\r\n0;300\r\n0.1;350\r\n1;400\r\n", ";"),
        ("p\tMPa\n0\t300\n0.1\t350\n1\t400\n", "\t"),
        ("p MPa\n 0   300\n0.1 350\n1.0 400\n", None),
    ],
)
@pytest.mark.parametrize("kind", [Path, str])
def test_a_file_of_two_columns_is_a_curve(text, delimiter, kind, tmp_path):
    path = tmp_path / "of {steel}.csv"
    path.write_text(text, encoding="utf-8")
    assert Tabulated.from_csv(kind(path), delimiter) == Tabulated((0.0, 0.1, 1.0), (300.0, 350.0, 400.0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "rows of numbers = 0: must be at least two"),
        ("strain,stress\n0,300\n", "rows of numbers = 1: must be at least two"),
        ("0,300\n0.1\n", "line 2: columns = 1: must be 2, parted by the delimiter ',': plastic strain"),
        ("0;300\n0.1;350\n", "line 1: columns = 1"),
        ("0,300,1\n0.1,350,2\n", "line 1: columns = 3"),
        ("strain,300\n0,300\n", "line 1: plastic strain = 'strain': must be a number"),
        ("p,s\np,s\n0,300\n", "line 2: plastic strain = 'p': must be a number"),
        ("0,300\n0.1,soft\n", "line 2: yield stress = 'soft': must be a number"),
        ("0,300\n0.1,\n", "line 2: yield stress = '': must be a number"),
        ("0,300\n0.1,3_000\n", "line 2: yield stress = '3_000': must be a number"),
        ("# c\n\n0,300\nnan,350\n", "line 4: plastic strain = nan: must be finite"),
        ("0,300\ninf,350\n", "line 2: plastic strain = inf: must be finite"),
        ("0,300\n0.1,nan\n", "line 2: yield stress = nan: must be finite"),
        ("0,300\n0.1,1e999\n", "line 2: yield stress = inf: must be finite"),
        ("0,300\n0.1,1e61\n", "line 2: yield stress = 1e\\+61: .*other units"),
        ("0,300\n1e-300,301\n", "line 2: plastic strain = 1e-300: .*so far"),
        ("0.1,300\n0.2,350\n", "line 1: plastic strain = 0.1: .*from 0"),
        ("-0.1,300\n0.2,350\n", "line 1: plastic strain = -0.1: .*from 0"),
        ("0,300\n0.2,350\n0.1,360\n", "line 3: plastic strain = 0.1: .*strictly increasing"),
        ("0,300\n0.2,350\n0.2,360\n", "line 3: plastic strain = 0.2: .*strictly increasing"),
        ("0,-300\n0.2,350\n", "line 1: yield stress = -300.0: must be finite and > 0"),
        ("0,300\n0.2,250\n", "line 2: yield stress = 250.0: .*non-convex"),
    ],
)
def test_a_file_that_is_no_curve_is_refused_by_file_line_and_value(text, message, tmp_path):
    (tmp_path / "steel.csv").write_text(text)
    with pytest.raises(SceneError, match=rf"steel\.csv[,:] {message}"):
        Tabulated.from_csv(tmp_path / "steel.csv")


def test_what_is_no_text_file_is_refused_by_name(tmp_path):
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe0,300\n")
    for name in ("missing.csv", "binary.csv", "."):
        with pytest.raises(SceneError, match=rf"{re.escape(str(tmp_path / name))}: cannot be read as text"):
            Tabulated.from_csv(tmp_path / name)
    with pytest.raises(SceneError, match=r"path = 3: must be a path"):
        Tabulated.from_csv(3)
    for delimiter in (",,", "", ".", "#", 1):
        with pytest.raises(SceneError, match=r"delimiter = .*: must be one character"):
            Tabulated.from_csv(tmp_path / "missing.csv", delimiter)


CONTRIBUTING = Path(__file__).parents[1] / "CONTRIBUTING.md"


class Own:
    """A user's curve: two functions of arrays."""

    def __init__(self, stress, slope=lambda p: 0.0 * p):
        self.yield_stress, self.slope = stress, slope


@pytest.mark.parametrize(
    ("curve", "message"),
    [
        (Own(lambda p: 300.0), "hardening.yield_stress = 300.0: must be an array of peeq's shape, "),
        (Own(lambda p: 300.0 + p, lambda p: 1.0), "hardening.slope = 1.0: must be an array of peeq's shape, "),
        (
            Own(lambda p: 300.0 + math.sqrt(p)),
            r"hardening.yield_stress = TypeError: .*: must be an array of peeq's shape, of numbers: peeq is",
        ),
        (
            Own(lambda p: 300.0 + p, lambda p: 1.0 if p < 1.0 else 0.0),
            "hardening.slope = ValueError: .*: must be an array",
        ),
        (
            Own(lambda p: np.array([300.0 + math.sqrt(each) for each in p])),
            "hardening.yield_stress = TypeError: .*: must",
        ),
        (Own(lambda p: (300.0 + p).astype(object)), "must be an array of peeq's shape, of numbers: peeq"),
        (Own(lambda p: 0.0 * p), r"hardening.yield_stress\(0.0\) = 0.0: must be finite and > 0"),
        (Own(lambda p: 300.0 - 400.0 * p), r"yield_stress\(0.0001\) = 299.96: must be .* falling .*non-convex"),
        (Own(lambda p: np.where(p > 0.5, np.nan, 300.0)), r"hardening.yield_stress\(1.0\) = nan: must be finite"),
        (Own(lambda p: 300.0 + p, lambda p: p - 0.05), r"hardening.slope\(0.0\) = -0.05: must be finite and >= 0 "),
        (
            Own(lambda p: 300.0 + np.sqrt(p), lambda p: np.where(p > 0, 1.0, np.inf)),
            r"slope\(0.0\) = inf: must be finite",
        ),
    ],
)
def test_a_curve_of_a_users_own_is_tried_when_a_material_is_made(curve, message):
    with pytest.raises(SceneError, match=message):
        VonMises(Elasticity(210e3, 0.3), curve)


def test_a_curve_as_contributing_prints_it_is_known_to_the_command_line(tmp_path, monkeypatch):
    """As a script of its own, nothing else: then the word is read, shown in the help and upset."""
    monkeypatch.setattr(hardening_words, "CURVES", dict(BY_NAME))
    block = re.search(r"```python\n(.*?)```", CONTRIBUTING.read_text(encoding="utf-8"), re.DOTALL).group(1)
    assert len(block.splitlines()) <= 24
    exec(compile(block, str(CONTRIBUTING), "exec"), {"__name__": "script"})
    curve = hardening_from_text("ghosh:500,0.01,0.2,20")
    assert float(curve.yield_stress(0.09)) == pytest.approx(500 * 0.1**0.2 - 20)
    assert "ghosh:strength,offset,exponent,lost" in upsetting_case.parser().format_help().replace("\n", "")
    arguments = ["--mu", "0.1", "--elements", "1", "--increments", "2", "--reduction", "0.02"]
    assert upsetting.main([*arguments, "--hardening", "ghosh:500,0.01,0.2,20", "--out", str(tmp_path)]) == 0


def test_a_curve_is_read_from_no_pipe_device_or_file_of_any_size(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with (tmp_path / "large").open("wb") as file:
        file.truncate(2**40)
    no_file = "it is no regular file"
    for path, words in ((tmp_path / "pipe", no_file), ("/dev/zero", no_file), (tmp_path / "large", "bytes = ")):
        with pytest.raises(SceneError, match=words):
            Tabulated.from_csv(path)
