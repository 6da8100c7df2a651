"""Scalars of NumPy, of whatever precision, are the numbers they hold: what is computed is in double precision."""

from dataclasses import fields, replace

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.conic.clarabel import Clarabel
from bipot.conic.solver import Accuracy
from bipot.control.landing import Locate
from bipot.forms import Newton, Penalty, Uzawa
from bipot.forms.newton import Reuse
from bipot.forms.search import Search
from bipot.increment import Limits
from bipot.laws.hardening import Linear, Perfect, Swift, Tabulated, Voce
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march
from bipot.meshes.cells import Fine
from bipot.meshes.elements import Element
from bipot.meshes.layout import Layout
from bipot.meshes.sections import block, cylinder, ring
from bipot.meshes.solids import brick, cylinder_3d, ring_3d
from bipot.paths import Amplitude
from bipot.programs.fixed_point import Safeguard
from bipot.scene.supports import Support
from bipot.tools.tool import FlatTool
from tests.scenes import refused, scene

KINDS = (np.float16, np.float32, np.longdouble)

MADE = (
    lambda t: Elasticity(t(210.0), t(0.3)),
    lambda t: Perfect(t(0.3)),
    lambda t: Linear(t(0.3), t(0.7)),
    lambda t: Voce(t(0.3), t(0.1), t(9.7), t(0.2)),
    lambda t: Swift(t(0.3), t(0.1), t(0.2)),
    lambda t: Tabulated((t(0.0), t(0.1)), (t(0.3), t(0.4))),
    lambda t: Schedule(3, first=t(0.1), growth=t(1.7), landings=(t(0.9),)),
    lambda t: Schedule(accuracy=t(0.01)),
    lambda t: Limits(Bounds(t(0.1)), progress=t(0.7)),
    lambda t: Locate(t(0.01), margin=t(0.1)),
    lambda t: Safeguard(falls=t(0.7), least=t(0.1)),
    lambda t: Newton(Reuse(t(0.1), t(0.1), t(0.1)), Search(t(0.7), t(0.3), t(0.7))),
    lambda t: Penalty(t(10.3), t(10.7)),
    lambda t: Uzawa(t(10.3), t(10.7)),
    lambda t: Accuracy(t(1e-3)),
    lambda t: Clarabel(seconds=t(10.3)),
    lambda t: Fine(t(0.3), 2),
)


def numbers(made):
    """All floats of a frozen object and of its parts."""
    for field in fields(made):
        value = getattr(made, field.name)
        if isinstance(value, np.floating | float):
            yield value
        elif isinstance(value, tuple):
            yield from value
        elif hasattr(value, "__dataclass_fields__"):
            yield from numbers(value)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("make", MADE)
def test_scalars_become_plain_floats(make, kind):
    made = make(kind)
    assert {type(value) for value in numbers(made)} == {float}
    assert made == make(lambda value: float(kind(value)))


@pytest.mark.parametrize(
    "make",
    [
        *MADE,
        lambda t: Amplitude(((0.0, t(0.0)), (1.0, 1.0))),
        lambda t: Schedule(t(3.0)),
        lambda t: Support("base", t(1.0)),
        lambda t: block(1.0, 1.0, t(2.0), 2),
        lambda t: brick(t(1.0), 1.0, 1.0, 2, 2, 2),
    ],
)
def test_a_duration_is_no_number(make):
    """NumPy derives it from its integers; each of these ended as a TypeError."""
    refused(lambda: make(lambda value: np.timedelta64(int(value), "s")), "must be")


@pytest.mark.parametrize("kind", KINDS)
def test_friction_becomes_plain_floats(kind):
    tool = FlatTool((0.0, 1.0), (0.0, -1.0), (0.0, -0.1), ("top",), kind(0.1), shear=kind(0.3))
    assert (type(tool.mu), type(tool.shear)) == (float, float)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "curve",
    [
        lambda t: Linear(t(0.3), t(0.7)),
        lambda t: Voce(t(0.3), t(0.1), t(9.7), t(0.2)),
        lambda t: Swift(t(0.3), t(0.1), t(0.2)),
    ],
)
def test_a_march_is_that_of_the_same_numbers(kind, curve):
    """With half precision forces were off by 1e-3, and 128 bits ended as a TypeError."""

    def force(number):
        material = VonMises(Elasticity(number(210.0), number(0.3)), curve(number))
        *_, last = march(replace(scene(), material=material), Schedule(2, first=number(0.1)), Control())
        return last.tool_force(0), last.state.stress

    for one, other in zip(force(kind), force(lambda value: float(kind(value))), strict=True):
        assert one.dtype == np.float64
        np.testing.assert_array_equal(one, other)


MAKERS = (
    lambda size, count: block(size, size, count, count, element=Element.Q8),
    lambda size, count: block(
        size, size, count, count, grading=(2.0, Fine(size / 8, count // 2)), layout=Layout.FANNED
    ),
    lambda size, count: cylinder(size, size, count, count),
    lambda size, count: ring(size, 2 * size, size, count, count),
    lambda size, count: brick(size, size, size, count, count, count, element=Element.T10),
    lambda size, count: cylinder_3d(size, size, count, count, count, element=Element.T10, inscribed=False),
    lambda size, count: ring_3d(size, 2 * size, size, count, count, count, element=Element.T10, inscribed=False),
)


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("size", [2**70, np.float32(4.0), np.longdouble(4.0), 4])
def test_sizes_of_any_number_make_the_mesh_of_that_float(make, size):
    """Whole numbers beyond those of an array ended as a UFuncTypeError."""
    np.testing.assert_array_equal(make(size, 2).nodes, make(float(size), 2).nodes)


def test_counts_of_numpy_do_not_overflow_in_their_own_type():
    np.testing.assert_array_equal(block(1.0, 1.0, np.int8(127), 1).nodes, block(1.0, 1.0, 127, 1).nodes)
    there = ring_3d(1.0, 2.0, 1.0, np.int8(8), np.int8(8), np.int8(8))
    np.testing.assert_array_equal(there.nodes, ring_3d(1.0, 2.0, 1.0, 8, 8, 8).nodes)


@pytest.mark.parametrize("make", [lambda v: Tabulated(v, (1.0, 2.0)), lambda v: Tabulated((0.0, 1.0), v)])
def test_an_array_of_no_axis_is_no_table(make):
    for junk in (np.array("q"), np.array(1.0), np.zeros((2, 2))):
        refused(lambda junk=junk: make(junk), "must be a tuple of numbers")
