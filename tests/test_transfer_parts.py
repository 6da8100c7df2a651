"""Bodies of several parts that are drawn anew: each part by itself."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import griddata

from bipot import (
    Amplitude,
    Control,
    DeformableTool,
    Element,
    Geometry,
    Newton,
    Prescribed,
    Scene,
    Schedule,
    Support,
    Symmetry,
    apart,
    block,
    brick,
    cylinder,
    march,
    together,
    transferred,
)
from tests.deformable import ELASTIC, STEEL, shifted
from tests.scenes import refused

NEWTON = Control(Newton(), ())
THERE, BACK = ((0.0, 0.0), (1.0, 1.0)), ((0.0, 0.0), (0.8, 1.0), (1.0, 0.9))


def scene(parts, press, path=THERE, mu=0.2):
    """A billet beneath an elastic punch."""
    supports = (
        Symmetry("billet/base", 1),
        Support("billet/axis", 0),
        Support("punch/axis", 0),
        Prescribed("punch/top", 1, -press, Amplitude(path)),
    )
    tool = DeformableTool(("punch/base",), ("billet/top", "billet/side"), mu)
    return Scene(together(parts), Geometry.AXISYMMETRIC, STEEL, supports, (tool,), regions={"punch": ELASTIC})


def meshes(n=4):
    return {"billet": cylinder(5.0, 5.0, n, n), "punch": shifted(cylinder(8.0, 3.0, n, 2), 0.0, 5.0)}


def lifted():
    """What a billet is when the punch has been lifted: its scene and state."""
    first = scene(meshes(), 0.6, BACK)
    *_, last = march(first, Schedule(10, first=0.02, settling=1, growth=4.0), NEWTON)
    return first, last.state


def deformed(first, state):
    return apart(replace(first.mesh, nodes=state.nodes))


def pressed(onto, state):
    *_, last = march(onto, Schedule(4), NEWTON, start=state)
    return last.tool_force(0)[1]


def test_a_part_drawn_anew_bears_what_the_old_one_would():
    first, state = lifted()
    left = deformed(first, state)
    old, grid = cylinder(5.0, 5.0, 4, 4), cylinder(5.0, 5.0, 6, 5)
    drawn = replace(grid, nodes=griddata(old.nodes, left["billet"].nodes, grid.nodes))
    forces = []
    for billet in (left["billet"], drawn):
        # The parts may be given in any order.
        onto = scene({"punch": left["punch"], "billet": billet}, 0.5)
        found = transferred(state, first, onto)
        forces.append(pressed(onto, found.state))
        assert abs(found.volume) < 1e-3
        assert abs(found.peeq) < 5e-3
    assert forces[0] < -40e3
    np.testing.assert_allclose(forces[1], forces[0], rtol=5e-3)


def test_on_the_same_meshes_nothing_changes():
    first, state = lifted()
    again = transferred(state, first, scene(deformed(first, state), 0.5))
    for name in ("nodes", "stress", "plastic_strain", "peeq"):
        was = getattr(state, name)
        np.testing.assert_allclose(getattr(again.state, name), was, atol=1e-6 * np.abs(was).max())
    assert again.moved < 1e-9


def test_parts_in_space_are_taken_on():
    """What a deformable tool is elsewhere had tips of two coordinates."""
    low, up = brick(1.0, 1.0, 1.0, 2, 2, 1), shifted(brick(2.0, 2.0, 1.0, 1, 1, 1), 0.0, 0.0, 1.0)
    way = Amplitude(((0.0, 0.0), (0.5, 1.0), (1.0, -1.0)))
    held = (*(Support(f"{part}/{side}", k) for part in ("low", "up") for k, side in enumerate(("left", "front"))),)
    supports = (*held, Support("low/base", 2), Prescribed("up/top", 2, -0.02, way))
    tools = (DeformableTool(("up/base",), ("low/top",), 0.1),)
    first = Scene(together({"low": low, "up": up}), Geometry.SOLID, STEEL, supports, tools)
    *_, last = march(first, Schedule(4), NEWTON)
    again = transferred(last.state, first, replace(first, mesh=replace(first.mesh, nodes=last.state.nodes)))
    np.testing.assert_allclose(again.state.peeq, last.state.peeq, rtol=1e-9, atol=1e-12)
    assert again.moved < 1e-9


def test_apart_gives_what_was_joined():
    given = {
        "one": block(1.0, 1.0, 2, 1, element=Element.Q8),
        "two": shifted(block(2.0, 1.0, 1, 3, element=Element.Q8), 3.0, 0.0),
    }
    given["two"] = replace(given["two"], regions={"core": [1]})
    found = apart(together(given))
    assert found == given
    # A region of a part may be all of it.
    given["one"] = replace(given["one"], regions={"all": [0, 1]})
    assert apart(together(given)) == given
    # Whatever the parts are called, and where boundaries have names without theirs.
    both = together(given)
    named = replace(both, boundaries={"all": np.concatenate([both.boundary("one/top"), both.boundary("two/base")])})
    assert {name: len(mesh.boundary("all")) for name, mesh in apart(named).items()} == {"one": 2, "two": 1}


def test_what_does_not_fit_is_refused():
    first, state = lifted()
    left = deformed(first, state)
    refused(lambda: apart(left["punch"]), "of several parts")
    nameless = replace(first.mesh, regions={"punch": first.mesh.region("punch")})
    refused(lambda: apart(nameless), "each of which is a region")
    onto = scene(left, 0.5)
    refused(lambda: transferred(state, replace(first, mesh=nameless), onto), r"scene.mesh.* each of which is a region")
    other = replace(
        onto, mesh=replace(onto.mesh, regions={"slug": onto.mesh.region("billet"), "punch": onto.mesh.region("punch")})
    )
    refused(lambda: transferred(state, first, other), r"onto.mesh: its parts.*slug")
    wider = replace(left["punch"], nodes=left["punch"].nodes * [1.05, 1.0])
    refused(lambda: transferred(state, first, scene({**left, "punch": wider}, 0.5)), "part 'punch': its volume")
    # The core of the one part has become one of the other.
    before, after = (
        replace(one, mesh=replace(one.mesh, regions={**one.mesh.regions, "core": [k]}), regions={"core": ELASTIC})
        for one, k in ((first, 0), (onto, 23))
    )
    refused(lambda: transferred(state, before, after), r"onto.mesh, part '\w+': its parts of one material")
