"""Tools that go along a force and across it by a path; what is no force on a tool is refused."""

import pytest

from bipot import (
    Amplitude,
    Configuration,
    Control,
    Dissipation,
    Elasticity,
    FlatTool,
    Force,
    Geometry,
    IncrementFailed,
    Newton,
    Perfect,
    Scene,
    SceneError,
    Schedule,
    Support,
    Tangent,
    VonMises,
    block,
    march,
)
from bipot.meshes.elements import Element


def punch(**changes):
    given = {"point": (0.0, 1.0), "normal": (0.0, -1.0), "travel": (0.0, 0.0), "candidates": ("top",), "mu": 0.1}
    return FlatTool(**(given | changes))


def slab(tool, poisson=0.3, elements=(8, 2)):
    """A block clamped at its base, elastic as far as matters, in small strain."""
    return Scene(
        mesh=block(4.0, 1.0, *elements, element=Element.Q8),
        geometry=Geometry.PLANE_STRAIN,
        material=VonMises(Elasticity(1000.0, poisson), Perfect(1e6)),
        supports=(Support("base", 0), Support("base", 1)),
        tools=(tool,),
        configuration=Configuration.SMALL,
    )


def test_press_by_a_force_then_slide_by_the_path():
    """The normal force stays while the tool drags the block, by mu times it once all slides."""
    held = Force((0.0, -20.0), Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, 1.0))))
    dragging = punch(travel=(0.5, 0.0), mu=0.2, path=((0.0, 0.0), (0.5, 0.0), (1.0, 1.0)), driven_by=held)
    *_, last = march(slab(dragging), Schedule(10), Control(Newton(), (Tangent(), Dissipation())))
    assert last.tool_forces[0] == pytest.approx([0.2 * 20.0, -20.0], rel=1e-7)
    assert last.energies.friction > 0
    assert abs(last.energies.energy_error) < 5e-3


def test_a_force_along_the_tool_sticks_below_friction_and_never_slides_off_above_it():
    """A tool pressed by its path and dragged by a force: mu N is the most it can be."""
    late = Amplitude(((0.0, 0.0), (0.5, 1e-6), (1.0, 1.0)))

    def dragged(force):
        pressing = ((0.0, 0.0), (0.5, 1.0), (1.0, 1.0))
        tool = punch(travel=(0.0, -0.01), mu=0.2, path=pressing, driven_by=Force((force, 0.0), late))
        control = Control(Newton(), (Tangent(), Dissipation()), cuts=2)
        return list(march(slab(tool, poisson=0.0, elements=(4, 1)), Schedule(8), control))[-1]

    normal = -dragged(1.0).tool_forces[0, 1]
    assert normal == pytest.approx(40.0, rel=0.02)
    assert dragged(0.9 * 0.2 * normal).tool_forces[0, 0] == pytest.approx(0.9 * 0.2 * normal, rel=1e-7)
    with pytest.raises(IncrementFailed):
        dragged(1.1 * 0.2 * normal)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Force((0.0, 0.0)), "force.vector"),
        (lambda: Force((0.0, float("nan"))), "force.vector"),
        (lambda: Force("down"), "force.vector"),
        (lambda: Force((0.0, 1e70)), "force.vector"),
        (lambda: Force((0.0, -1.0), "ramp"), "force.amplitude"),
        (lambda: Force((0.0, -1.0), Amplitude(((0, 0), (0.5, 1), (1, 0)))), "force.amplitude .* above zero after"),
        (lambda: Force((0.0, -1.0), Amplitude(((0, -1), (1, 1)))), "force.amplitude"),
        (lambda: punch(driven_by=Force((0.0, 1.0))), "tool.driven_by .* it pulls off"),
        (lambda: punch(driven_by=(0.0, -1.0)), "tool.driven_by"),
        (lambda: punch(driven_by=Force((0.0, -1.0)), travel=(0.0, -1.0)), "tool.travel .* across the force"),
        (lambda: punch(driven_by=Force((1.0, -1.0)), travel=(1.0, 0.0)), "tool.travel .* across the force"),
    ],
)
def test_bad_forces_are_refused(make, words):
    with pytest.raises(SceneError, match=words):
        make()
