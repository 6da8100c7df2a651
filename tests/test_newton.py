"""The Newton form on whole increments: equality with the conic forms, convergence, length of its steps."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.control.accepted import Accepted
from bipot.fem.strain import Configuration
from bipot.forms import Cache, Dissipation, FormName, Newton, Tangent
from bipot.forms.newton import Reuse
from bipot.forms.search import Search
from bipot.increment import Limits, Trial, solve_increment
from bipot.iterate import Increment
from bipot.marching import Control, Schedule, march, system_of
from bipot.paper import upsetting
from bipot.programs.ordering import Pattern
from bipot.scene.loads import Pressure
from bipot.scene.scene import Scene
from bipot.tools.tool import FlatTool
from studies.verification.cases.thick_tube import ABOVE, LIMIT, SCHEDULE, tube

TIGHT = Limits(Bounds(equilibrium=1e-11), passes=60, patience=12)
STARTING = Schedule(6, first=0.004, settling=4)
ALONE = Control(Newton(), ())


def run(control: Control, mu: float, schedule: Schedule = STARTING, **scene: object) -> list[Accepted]:
    return list(march(upsetting(mu=mu, reduction=0.1, elements=4, **scene), schedule, control))  # type: ignore[arg-type]


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3, np.inf])
@pytest.mark.parametrize("configuration", Configuration)
def test_newton_and_conic_forms_agree(mu: float, configuration: Configuration) -> None:
    """Forces of every contact to 1e-8 of the largest, on identical increments; no fallback on either side."""
    ours, conic = (
        run(Control(form, (), TIGHT, cuts=0), mu, configuration=configuration) for form in (Newton(), Tangent())
    )
    for a, b in zip(ours, conic, strict=True):
        scale = np.abs(b.solved.r).max()
        assert a.state.tau == b.state.tau
        np.testing.assert_allclose(a.solved.r, b.solved.r, rtol=0, atol=1e-8 * scale)
        np.testing.assert_allclose(a.state.nodes, b.state.nodes, rtol=0, atol=1e-8)


def test_newton_converges_quadratically_once_the_pieces_are_right() -> None:
    """Residuals of one late increment, a fresh factor each pass: each at most a multiple of the last one's square."""
    steps = run(Control(Newton(), (), TIGHT), 0.1)
    start, tau = steps[-1].start, steps[-1].state.tau
    seen: list[Trial] = []
    system = system_of(upsetting(mu=0.1, reduction=0.1, elements=4))
    solve_increment(Increment(system, start, tau), Newton(Reuse(0.0)), TIGHT, Cache(), 1.0, seen.append)
    e = [trial.certificate.equilibrium for trial in seen]
    assert len(e) <= 6
    big = [i for i in range(1, len(e) - 1) if e[i] < 1e-2]
    assert big
    assert all(e[i + 1] <= 50 * e[i] ** 2 + 1e-12 for i in big)


def test_reused_factors_save_factorisations_not_accuracy(monkeypatch: pytest.MonkeyPatch) -> None:
    counts = {0.0: 0, 0.3: 0}
    real = Pattern.factorise
    forces = []
    for fall in counts:

        def counted(self: Pattern, *given: Any, fall: float = fall) -> object:
            counts[fall] += 1
            return real(self, *given)

        monkeypatch.setattr(Pattern, "factorise", counted)
        forces.append([a.solved.r for a in run(Control(Newton(Reuse(fall)), (), TIGHT), 0.1)])
    assert counts[0.3] < counts[0.0]
    for a, b in zip(*forces, strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-8 * np.abs(a).max())


def test_a_new_factor_saves_passes_where_a_kept_one_starts_from_far() -> None:
    """Kept wherever the merit falls, a factor takes a pass more in some increments and ends at the same."""
    scene, schedule = upsetting(mu=0.3, reduction=0.3, elements=4), Schedule(8, first=0.05, settling=1)
    far, near = (list(march(scene, schedule, Control(Newton(Reuse(near=most))))) for most in (0.9, Reuse().near))
    assert sum(a.passes for a in near) < sum(a.passes for a in far)
    for a, b in zip(far, near, strict=True):
        np.testing.assert_allclose(a.tool_forces, b.tool_forces, rtol=0, atol=1e-6 * np.abs(a.tool_forces).max())


def test_line_search_shortens_a_step_that_inverts_elements() -> None:
    """From rest in increments of 5 % the first full steps fold the mesh; without halving they may not recover."""
    control = Control(Newton(search=Search(trials=8)), (Dissipation(),), cuts=4)
    steps = list(march(upsetting(mu=0.1, reduction=0.1, elements=4), Schedule(2), control))
    assert steps[-1].state.tau == 1.0
    assert all(a.solved.certificate.equilibrium <= 5e-7 for a in steps)


@pytest.mark.slow
def test_landings_take_few_passes_where_contacts_are_far_from_their_law() -> None:
    """Within increment 22 of the cylinder at mu = 0.3 a side node lands, and much of the body unloads until 23 is over.

    The law's part of the merit tells how far in its tool the prediction has left the node, not how far to go; by whole
    steps alone increments are cut.
    """
    scene, schedule = upsetting(mu=0.3, elements=10), Schedule(12, first=0.001 / 0.45)
    before = next(a for a in march(scene, schedule, ALONE) if a.number == 21)

    def after(search: Search) -> list[Accepted]:
        return list(itertools.islice(march(scene, schedule, Control(Newton(search=search), ()), before.course), 2))

    found, near = after(Search()), after(Search(work=0.05))
    assert sum(a.passes for a in found) <= 19
    assert not any(a.cuts for a in found)
    assert any(a.cuts for a in after(Search(trials=0)))
    for a, b in zip(found, near, strict=True):
        np.testing.assert_allclose(a.solved.r, b.solved.r, atol=1e-5 * np.abs(b.solved.r).max())


def test_a_load_beyond_the_limit_is_given_up_soon_where_there_are_no_contacts() -> None:
    """A thick tube: of increments to its end the steps grow without end, and were halved as the merit did."""
    asked = replace(tube(5), loads=(Pressure("bore", ABOVE * LIMIT),))
    found = list(itertools.islice(march(asked, SCHEDULE), 13))
    assert found[-1].cuts > 0
    assert found[-1].state.tau > 0.99
    assert sum(a.passes for a in found) <= 165


def test_axis_node_without_share_of_the_pressure_settles() -> None:
    """The corner node of a Q8 on the axis has no consistent contact weight: its force stays a part of the next."""
    steps = run(Control(Newton(), (), cuts=0), 0.3)
    system = system_of(upsetting(mu=0.3, reduction=0.1, elements=4))
    nodes = system.body.scene.mesh.nodes[system.candidates.node]
    axis = int(np.argmin(nodes[:, 0] + 100 * (nodes[:, 1] < nodes[:, 1].max())))
    neighbour = int(np.argsort(nodes[:, 0] + 100 * (nodes[:, 1] < nodes[:, 1].max()))[1])
    for a in steps:
        assert a.form is FormName.NEWTON
        assert -1e-8 * np.abs(a.solved.r).max() <= a.solved.r[axis, 0] < 0.5 * a.solved.r[neighbour, 0]


def leaning(sine: float) -> Scene:
    """The cylinder under a punch that leans against its axis."""
    scene = upsetting(mu=0.2, reduction=0.1, elements=4)
    normal = (sine, -float(np.sqrt(1 - sine**2)))
    return replace(scene, tools=(replace(scene.tools[0], normal=normal, candidates=("top",)),))


def walled(inner: float, mu: float) -> Scene:
    """The cylinder under a punch, in a tube of that radius; the edge of its upper face is listed by both."""
    scene = upsetting(mu=0.2, reduction=0.1, elements=4)
    tube = FlatTool((inner, 0.0), (-1.0, 0.0), (0.0, 0.0), ("side",), mu)
    return replace(scene, tools=(replace(scene.tools[0], candidates=("top",)), tube))


@pytest.mark.parametrize(
    ("scene", "one"),
    [(leaning(0.03), True), (leaning(0.1), True), (walled(9.0, 0.1), True), (walled(5.05, 0.0), False)],
    ids=["leans inwards", "leans more", "open to one", "closed to both"],
)
def test_newton_takes_shared_and_inclined_contacts_as_the_conic_form_does(scene: Scene, one: bool) -> None:
    """Every increment of a march, by both: nodal forces to 1e-7 of the largest, no fallback.

    Where a node is closed to ``one`` tool at most, contact forces too, unless the law leaves open how rows share them.
    """
    system, last = system_of(scene), 0
    for a in march(scene, Schedule(8, first=0.004, settling=4), Control(Newton(), (), TIGHT)):
        other = solve_increment(Increment(system, a.start, a.state.tau), Tangent(), TIGHT, Cache(), 0.0)
        ours = solve_increment(Increment(system, a.start, a.state.tau), Newton(), TIGHT, Cache(), 0.0)
        on_nodes, theirs = (solved.rows.forces(solved.r) for solved in (ours, other))
        np.testing.assert_allclose(on_nodes, theirs, rtol=0, atol=1e-7 * np.abs(theirs).max())
        if one and not ours.undetermined:
            np.testing.assert_allclose(ours.r, other.r, rtol=0, atol=1e-7 * np.abs(other.r).max())
        last = a.number
    assert last >= 12
