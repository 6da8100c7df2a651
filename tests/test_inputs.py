"""Inputs that once changed the model in silence, or ended as raw exceptions, are converted or refused by name."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from bipot.certificate import Bounds
from bipot.conic.clarabel import Clarabel
from bipot.conic.solver import Accuracy
from bipot.control.landing import Locate
from bipot.errors import SceneError
from bipot.fem.elements import Quadrature
from bipot.fem.reduction import Geometry
from bipot.fem.strain import Configuration
from bipot.forms import Delassus, Dissipation, Newton, Penalty, Tangent, Uzawa
from bipot.forms.newton import Reuse
from bipot.forms.search import Search
from bipot.increment import Limits
from bipot.laws.hardening import Linear, Perfect, Tabulated, Voce
from bipot.laws.material import Elastic
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.marching import Control, Schedule, march
from bipot.meshes.elements import Element
from bipot.meshes.sections import block, cylinder, ring
from bipot.paper import unreturned, upsetting
from bipot.programs.factors import SuperLU
from bipot.programs.fixed_point import Safeguard
from bipot.scene.loads import Pressure
from bipot.scene.supports import Prescribed, Support, Symmetry
from tests.scenes import STEEL, refused, scene, tool

NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: scene(geometry="plane_strain"), r"'plane_strain': must be a Geometry, e.g. Geometry.PLANE_STRAIN"),
        (lambda: scene(configuration="paper"), r"'paper': must be a Configuration, e.g. Configuration.PAPER"),
        (lambda: scene(configuration="midpoint"), "scene.configuration = 'midpoint'"),
        (lambda: scene(configuration=Geometry.PLANE_STRAIN), "must be a Configuration, e.g. Configuration.MIDPOINT"),
        (lambda: scene(quadrature="gauss2"), "e.g. Quadrature.GAUSS2"),
        (lambda: upsetting(mu=0.1, sampling="weighted"), "'weighted': must be a Sampling, e.g. Sampling.WEIGHTED"),  # type: ignore[arg-type]
        (lambda: upsetting(mu=0.1, quadrature="gauss2"), "scene.quadrature = 'gauss2'"),
        (lambda: upsetting(mu=0.1, configuration="paper"), "scene.configuration = 'paper'"),
        (lambda: Tangent(kind="continuum"), "tangent.kind = 'continuum': must be a TangentKind"),
        (lambda: Tangent(solver="cvxpy"), r"tangent.solver = 'cvxpy': must be a ConicSolver, e.g. Clarabel\(\)"),
        (lambda: Dissipation(solver="cvxpy"), "dissipation.solver"),
        (lambda: Penalty(1.0, 1.0, optimiser="newton"), "e.g. Optimiser.NEWTON"),
        (lambda: Uzawa(1.0, 1.0, kind="consistent"), "e.g. TangentKind.CONSISTENT"),
        (lambda: Control(integration="BDF2"), "control.integration = 'BDF2': must be an Integration"),
        (lambda: Safeguard(first="threshold"), "safeguard.first = 'threshold': must be a Frozen"),
    ],
)
def test_a_string_is_no_member_of_an_enumeration(make, words):
    refused(make, words)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: upsetting(mu=0.1, hardening=300), "material.hardening = 300: must be a Hardening"),
        (lambda: upsetting(mu=0.1, hardening=Perfect), "material.hardening = .*: must be a Hardening"),
        (lambda: VonMises(210e3, Perfect(300.0)), "material.elasticity = 210000.0: must be an Elasticity"),
        (lambda: scene(mesh="cylinder"), "scene.mesh = 'cylinder': must be a Mesh"),
        (lambda: scene(material=Perfect(300.0)), "scene.material"),
        (lambda: scene(tools=tool()), "scene.tools = .*: must be a tuple of Tool"),
        (lambda: scene(tools=(Support("base", 1),)), r"scene.tools\[0\] = .*: must be among the supports"),
        (lambda: scene(loads=(Prescribed("top", 1, 0.1),)), r"scene.loads\[0\] = .*: must be among the supports"),
        (lambda: scene(supports=(Pressure("top", 1.0),)), r"scene.supports\[0\] = .*: must be among the loads"),
        (lambda: scene(supports=Support("base", 1)), "scene.supports = .*: must be a tuple of Support"),
        (lambda: Control(Newton), "control.form = .*: must be a Form"),
        (lambda: Control("newton"), "control.form = 'newton': must be a Form"),
        (lambda: Control(Tangent(), Dissipation()), "control.fallbacks = .*: must be a tuple of Form"),
        (lambda: Control(Tangent(), (0.1,)), r"control.fallbacks\[0\]"),
        (lambda: Control(limits=Bounds()), "control.limits = .*: must be a Limits"),
        (lambda: Control(locate=0.1), "control.locate = 0.1: must be a Locate or None"),
        (lambda: Limits(1e-6), "limits.bounds = 1e-06: must be a Bounds"),
        (lambda: Tangent(safeguard=None), "tangent.safeguard = None: must be a Safeguard"),
        (lambda: Tangent(accuracy=1e-9), "tangent.accuracy = 1e-09: must be an Accuracy"),
        (lambda: Dissipation(accuracy=1e-9), "dissipation.accuracy"),
        (lambda: Tangent(coupled="no"), "tangent.coupled = 'no': must be a bool"),
        (lambda: Dissipation(polished=0), "dissipation.polished = 0: must be a bool"),
        (lambda: Newton(reuse=0.05), "newton.reuse = 0.05: must be a Reuse"),
        (lambda: Newton(search=4), "newton.search = 4: must be a Search"),
        (lambda: Newton(linear="superlu"), "newton.linear = 'superlu': must be a LinearSolver"),
        (lambda: Newton(linear=SuperLU), "newton.linear = .*: must be a LinearSolver"),
        (lambda: Tangent(solver=Clarabel), "tangent.solver = .*: must be a ConicSolver"),
        (lambda: Delassus(solver="newton"), "delassus.solver = 'newton': must be a Solver or None"),
        (lambda: Delassus(limits=Limits()), "delassus.limits = .*: must be a Limits of bipot.coulomb"),
        (lambda: march(scene(), Schedule(2), Newton()), r"control = Newton\(.*must be a Control"),
        (lambda: march(scene(), 2), "schedule = 2: must be a Schedule"),
        (
            lambda: unreturned(replace(upsetting(mu=0.1), material=Elastic(STEEL.elasticity))),
            "scene.material = Elastic.*: must be a VonMises",
        ),
        (lambda: march(STEEL, Schedule(2)), "scene = VonMises.*: must be a Scene"),
        (lambda: march(scene(), Schedule(2), start=0.5), "start = 0.5: must be a State, a Course or None"),
    ],
)
def test_a_wrong_type_gets_a_sentence_when_the_object_is_made(make, words):
    refused(make, words)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Schedule(2.5), "increments = 2.5: must be a whole number"),
        (lambda: Schedule(True), "increments = True: must be a whole number"),
        (lambda: Schedule(NAN), "increments = nan"),
        (lambda: Schedule(0), "increments = 0: must be >= 1"),
        (lambda: Schedule(2, settling=1.5), "settling = 1.5"),
        (lambda: Schedule(2, first=NAN), "first = nan"),
        (lambda: Schedule(2, first="0.1"), "first = '0.1': must be a number"),
        (lambda: Schedule(2, landings=0.5), "landings = 0.5: must be a tuple of numbers"),
        (lambda: Schedule(2, landings=("0.5",)), "landing = '0.5': must be a number"),
        (lambda: Schedule(2, landings=(0.5, 0.5)), "landings = .*: must be different"),
        (lambda: Schedule(2, landings=(0.5, 0.5 + 1e-12)), "landings = .*: must be different by more than 1e-09"),
        (lambda: Schedule(accuracy=1e-3, landings=(5e-324,)), "landing = 5e-324: must be in .* 1e-09 from its ends"),
        (lambda: Schedule(2, landings=(1 - 1e-12,)), "landing = .*: must be in .* 1e-09 from its ends"),
        (lambda: Support("base", True), "support.direction = True"),
        (lambda: Support("base", 1.0), "support.direction = 1.0"),
        (lambda: Support(1, 1), "support.boundary = 1: must be a str"),
        (lambda: Control(cuts=1.5), "cuts = 1.5"),
        (lambda: march(scene(), Schedule(2), observe=None), "observe = None: must be a function of a Trial"),
        (lambda: Limits(passes=0), "limits.passes = 0: must be >= 1"),
        (lambda: Limits(passes=2.5), "limits.passes = 2.5"),
        (lambda: Limits(patience=0), "limits.patience = 0"),
        (lambda: Limits(progress=-0.1), "limits.progress = -0.1: must be in"),
        (lambda: Limits(progress=NAN), "limits.progress = nan"),
        (lambda: Bounds(-1), "bounds.equilibrium = -1.0: must be > 0"),
        (lambda: Bounds(relative_gap=NAN), "bounds.relative_gap = nan"),
        (lambda: Bounds(cone_violation=0.0), "bounds.cone_violation = 0.0: must be > 0"),
        (lambda: Bounds(penetration="1e-9"), "bounds.penetration = '1e-9': must be a number"),
        (lambda: Tangent(halvings=1.5), "tangent.halvings = 1.5"),
        (lambda: Search(trials=2.5), "newton.search.trials = 2.5"),
        (lambda: Search(fall=1.0), "newton.search.fall = 1.0"),
        (lambda: Search(work=INF), "newton.search.work = inf"),
        (lambda: Search(landing=-0.1), "newton.search.landing = -0.1"),
        (lambda: Reuse("0"), "newton.reuse.fall = '0': must be a number"),
        (lambda: Reuse(near=1.0), "newton.reuse.near = 1.0: must be in"),
        (lambda: Safeguard(patience=1.5), "safeguard.patience = 1.5"),
        (lambda: Safeguard(depth=1.5), "safeguard.depth = 1.5"),
        (lambda: Locate(solves=1.5), "locate.solves = 1.5"),
        (lambda: Accuracy(iterations=1.5), "iterations = 1.5"),
        (lambda: Elasticity("210e3", 0.3), "young = '210e3': must be a number"),
        (lambda: Elasticity(210e3, None), "poisson = None: must be a number"),
        (lambda: Perfect("300"), "sigma_y = '300': must be a number"),
        (lambda: Perfect(True), "sigma_y = True: must be a number"),
        (lambda: Linear(300.0, "1"), "modulus = '1': must be a number"),
        (lambda: Voce(300.0, "1", 1.0), "saturation = '1': must be a number"),
        (lambda: Tabulated(0.1, (1.0, 2.0)), "peeq = 0.1"),
        (lambda: Tabulated((0.0, 0.1), ("a", "b")), "stress = .*: must be a number"),
        (lambda: Penalty("1", 1.0), "K_n = '1': must be a number"),
        (
            lambda: cylinder(1.0, 1.0, 1.5, 1, element=Element.Q8),
            "n_r = 1.5: must be a whole number",
        ),
        (lambda: cylinder("1", 1.0, 1, 1, element=Element.Q8), "radius = '1': must be a number"),
        (lambda: ring(1.0, "2", 1.0, 1, 1, element=Element.Q8), "outer = '2': must be a number"),
        (lambda: upsetting(mu=0.1, elements=2.5), "elements = 2.5: must be a whole number"),
        (lambda: upsetting(mu="0.1"), "mu = '0.1': must be a number"),
        (lambda: upsetting(mu=0.1, height="10"), "height = '10': must be a number"),
        (lambda: upsetting(mu=0.1, reduction=None), "reduction = None: must be a number"),
    ],
)
def test_numbers_and_counts_are_refused_by_name(make, words):
    refused(make, words)


def test_numbers_of_numpy_are_numbers():
    assert Schedule(np.int64(2), first=np.float64(0.1)).times()[-1] == 1
    assert upsetting(mu=np.float32(0.5), elements=np.int32(1)).tools[0].mu == 0.5
    assert Bounds(equilibrium=INF).equilibrium == INF


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"travel": (0.1,)}, r"tool.travel = \(0.1,\): must be two finite numbers"),
        ({"travel": 0.1}, "tool.travel = 0.1: must be two finite numbers"),
        ({"travel": (0.0, "1")}, "tool.travel"),
        ({"travel": (0.0, 1.0, 0.0)}, "tool.travel"),
        ({"travel": np.zeros((2, 1))}, "tool.travel"),
        ({"point": (0.0, 1.0, 2.0)}, "tool.point"),
        ({"point": None}, "tool.point = None"),
        ({"normal": (1.0,)}, "tool.normal"),
        ({"path": ((0.0, 0.0),)}, "tool.path"),
        ({"path": (0.0, 1.0)}, "tool.path = 0.0: must be pairs"),
        ({"path": ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))}, "tool.path"),
        ({"path": ((0.0, 0.0), (1.0, NAN))}, "tool.path"),
        ({"candidates": "top"}, "tool.candidates = 'top': must be a tuple of str"),
        ({"candidates": ("top", 1)}, r"tool.candidates\[1\] = 1: must be a str"),
        ({"candidates": ("top", "top")}, "tool.candidates = .*: must be different"),
        ({"mu_at": {0: True}}, r"mu_at\[0\] = True"),
        ({"mu_at": {0: -0.1}}, r"mu_at\[0\] = -0.1: must be finite and >= 0"),
        ({"mu_at": {"0": 0.1}}, "mu_at node = '0': must be a whole number"),
        ({"mu_at": [(0, 0.1)]}, "mu_at = .*: must be a Mapping"),
        ({"mu": INF, "mu_at": {0: 0.1}}, "mu_at = .*: must be empty where mu = inf"),
    ],
)
def test_a_tool_is_checked_for_shape_and_kind(changes, words):
    refused(lambda: tool(**changes), words)


def test_arrays_and_lists_become_plain_numbers_in_a_tool():
    travel = np.array([0.0, -0.1])
    made = tool(travel=travel, path=[[0, 0], [1, 1]], candidates=["top"], mu_at={np.int64(3): 0.2})
    travel[1] = 5.0
    assert made.travel == (0.0, -0.1)
    assert made.path == ((0.0, 0.0), (1.0, 1.0))
    assert made.candidates == ("top",)
    assert dict(made.mu_at) == {3: 0.2}
    with pytest.raises(TypeError):
        made.mu_at[3] = 0.5
    assert pickle.loads(pickle.dumps(made)).moved(0.0, 1.0).tolist() == [0.0, -0.1]


def test_a_coefficient_at_a_node_that_is_no_candidate_is_refused():
    base = int(block(1.0, 1.0, 2, 2, element=Element.Q8).boundary_nodes("base")[0])
    refused(
        lambda: scene(tools=(tool(mu_at={base: 0.3}),)), f"mu_at node = {base}: must be one of the tool's candidates"
    )


def test_a_tool_that_can_touch_nothing_is_refused():
    """All its candidates held along its normal: it had no contact rows, and the march ended as a raw ValueError."""
    held = (Support("base", 1), Support("left", 0), Support("top", 1))
    refused(lambda: scene(supports=held), r"tools\[0\].candidates = \('top',\): must be .* can move along its normal")


def test_a_body_held_everywhere_is_refused():
    sides = [Support(name, d) for name in ("base", "left", "top", "right") for d in (0, 1)]
    refused(
        lambda: scene(mesh=block(1.0, 1.0, 1, 1, element=Element.Q8), supports=tuple(sides)),
        "scene.supports = .*: must be such that they leave a node free",
    )


def test_supports_and_tools_may_come_as_lists():
    made = scene(tools=[tool()], supports=[Support("base", 1)])
    assert isinstance(made.tools, tuple)
    assert isinstance(made.supports, tuple)
    assert made.rule is Quadrature.RADON7
    assert made.configuration is Configuration.MIDPOINT
    assert replace(made, supports=[Symmetry("base", 1)]).images == 2


def test_a_fallback_of_the_same_name_is_kept_and_the_same_form_is_not_repeated():
    """Compared by name, ``Tangent(coupled=False)`` was dropped."""
    other = Tangent(coupled=False)
    assert Control(Tangent(), (other,)).forms == (Tangent(), other)
    assert Control(Tangent(), (Tangent(), Dissipation(), other, other)).forms == (Tangent(), Dissipation(), other)


def test_a_message_shows_the_beginning_of_a_long_value():
    """A scene in the place of a schedule has much of itself in its text, if not its arrays."""
    given = scene()
    with pytest.raises(SceneError) as refusal:
        march(given, given)
    words = str(refusal.value)
    assert words.startswith("schedule = Scene(mesh=Mesh(")
    assert words.endswith(" ...: must be a Schedule")
    assert len(words) < 400 < len(repr(given))
    assert "\n" not in words
