"""The columns of a history that all studies share; a study adds others and fixes units and order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bipot.certificate import Bounds
from bipot.checks.cancelled import cancelled
from bipot.contact.overlap import overlap, unfelt
from bipot.control.accepted import Accepted
from bipot.control.estimate import error_estimate
from bipot.errors import require, require_positive, require_type
from bipot.fem.orientation import scaled_jacobians
from bipot.system import System

Value = float | int | str


def encodes(text: str) -> bool:
    """Whether a text can be written in UTF-8, which has no surrogates."""
    return not any("\ud800" <= letter <= "\udfff" for letter in text)


@dataclass(frozen=True)
class Column:
    """One column of a history: its header, its meaning and unit, and the function that computes it."""

    name: str
    meaning: str
    value: Callable[[System, Accepted], Value]

    def __post_init__(self) -> None:
        require_type(self.name, str, "column.name")
        require(encodes(self.name), "column.name", self.name, "a text that UTF-8 has, without halves of letters")
        require(
            callable(self.value), f"column {self.name!r}: value", self.value, "a function of a system and an Accepted"
        )


INCREMENT = Column("increment", "number of the accepted increment, from 1", lambda _, a: a.number)
SECONDS = Column("seconds", "wall time of the increment, s", lambda _, a: a.seconds)
COURSE = (
    Column("passes", "passes spent, failed attempts included", lambda _, a: a.passes),
    Column("cuts", "times the increment was halved", lambda _, a: a.cuts),
    Column("form", "the form that solved it", lambda _, a: a.form.value),
    Column("reason", "why a fallback was used or the increment was cut", lambda _, a: a.reason),
    Column("route", "how friction was coupled in the accepted pass", lambda _, a: a.solved.coupled.route.value),
    Column(
        "contraction",
        "reduction of the coupling's residual per pass; nan if too few passes",
        lambda _, a: a.solved.coupled.contraction,
    ),
    Column(
        "coupling_steps", "passes in which friction was coupled by the fixed point", lambda _, a: a.solved.coupled.steps
    ),
    Column(
        "undetermined",
        "forces or positions that the law does not determine",
        lambda _, a: "; ".join(a.solved.undetermined),
    ),
    Column(
        "below_resolution",
        "measures that decide nothing: round-off alone may exceed their default bound",
        lambda _, a: "; ".join(a.solved.certificate.below_resolution(Bounds())),
    ),
)


def flow_gap(system: System, accepted: Accepted) -> float:
    """sum_q w |sigma_Y |de_p|_eq - sigma : de_p| over sum_q w sigma_Y |de_p|_eq, of the plastic strain as stored.

    Zero with backward Euler. With BDF2 the flow carried on from the last increment is not normal to the yield surface
    at the end of this one: a discretisation error that the certificate of the posed increment does not contain.
    """
    start, end, kin = accepted.start, accepted.state, accepted.solved.response.kinematics
    flow = end.plastic_strain - kin.turned(start.plastic_strain)
    length = kin.volume * system.body.scene.materials.dissipation(flow, end.peeq)
    gap = np.abs(length - kin.volume * np.vecdot(end.stress, flow)).sum()
    return float(gap / length.sum()) if length.any() else 0.0


FLOW_GAP = Column(
    "flow_gap", "dissipation missed because the stored flow is not normal to the yield surface, fraction", flow_gap
)

ERROR_ESTIMATE = Column(
    "error_estimate",
    "estimated error of the force due to the increment's length (bipot.control.estimate), fraction",
    lambda _, a: error_estimate(a.start, a.solved),
)
OVERLAP = Column(
    "overlap",
    "largest penetration anywhere on the edges and faces that may touch a tool over body size",
    lambda _, a: overlap(a.scene, a.state.nodes, a.poses),
)
UNFELT = Column(
    "unfelt",
    "how far surface nodes that are not candidates of a tool went behind its surface, over body size",
    lambda _, a: unfelt(a.scene, a.state.nodes, a.poses),
)
CANCELLED = Column(
    "cancelled",
    "friction that contact in means leaves out, as slips of different directions cancel, over the work and it",
    lambda _, a: cancelled(a.solved.iterate, a.solved.r),
)
ENERGY_ERROR = Column(
    "energy_error",
    "work minus elastic, plastic and frictional energy, over the work, all accumulated, fraction",
    lambda _, a: a.energies.energy_error,
)
MIN_JACOBIAN = Column(
    "min_jacobian",
    "least det J over its mean, in the worst element: a lower bound within 0.1 %",
    lambda system, a: float(scaled_jacobians(a.state.nodes, system.body.scene.mesh.elements).min()),
)


def energies(unit: str, factor: float = 1.0) -> tuple[Column, ...]:
    """Accumulated energies of the whole body, times ``factor`` in the ``unit``, and the energy error.

    In plane strain they are per unit of thickness, and so is the ``unit``.

    >>> [column.name for column in energies("J", 1e-3)]
    ['work_J', 'elastic_J', 'plastic_J', 'friction_J', 'energy_error']
    """
    _require_unit(unit, factor)
    meanings = {
        "work": "work of tools, loads and supports",
        "elastic": "elastic energy",
        "plastic": "plastic dissipation and energy stored by hardening",
        "friction": "frictional dissipation",
    }

    def column(name: str, meaning: str) -> Column:
        return Column(f"{name}_{unit}", f"{meaning}, {unit}", lambda _, a: factor * getattr(a.energies, name))

    return (*(column(name, meaning) for name, meaning in meanings.items()), ENERGY_ERROR)


def certificate(unit: str, factor: float = 1.0) -> tuple[Column, ...]:
    """The certificate's measures; the gap is that of the whole body, times ``factor`` in the energy ``unit``.

    >>> [column.name for column in certificate("J", 1e-3)][-2:]
    ['bipotential_gap_J', 'relative_gap']
    """
    _require_unit(unit, factor)

    def measure(name: str, meaning: str) -> Column:
        return Column(name, meaning, lambda _, a: getattr(a.solved.certificate, name))

    def gap(system: System, accepted: Accepted) -> float:
        return factor * system.body.scene.images * accepted.solved.certificate.gap

    return (
        measure("equilibrium", "largest residual over largest nodal force"),
        measure("tool_equilibrium", "largest residual of a driven tool over its force, or moment"),
        measure("yield_violation", "largest equivalent stress above yield over yield stress"),
        measure("penetration", "largest penetration over body size"),
        measure("cone_violation", "largest force outside the cone over largest force"),
        measure("law", "largest residual of Coulomb's law in units of force over largest force"),
        Column(f"bipotential_gap_{unit}", f"sum of bipotential and Fenchel gaps, {unit}", gap),
        measure("relative_gap", "that gap over the largest energy of the increment"),
    )


def _require_unit(unit: object, factor: object) -> None:
    require_type(unit, str, "unit")
    require_positive(factor=factor)
