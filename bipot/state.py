"""An accepted state of a body, and the state at rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.errors import require_type
from bipot.fem.elements import tabulated
from bipot.laws.flow import Flow
from bipot.scene.scene import Scene
from bipot.tensors import equivalent_stress, trace
from bipot.typing import EqualByNumbers, Floats, make_arrays, make_floats

ARRAYS = {
    "nodes": "(a, d)",
    "stress": "(e, q, s)",
    "plastic_strain": "(e, q, s)",
    "peeq": "(e, q)",
    "forces": "(c, d)",
    "gap": "(c,)",
    "du": "(a, d)",
    "translation": "(m,)",
    "translated": "(m,)",
}
"""The arrays of a state, and their shapes."""


@dataclass(frozen=True, eq=False, repr=False)
class State(EqualByNumbers):
    """An accepted state and the increment that led to it.

    Pseudo-time, nodes (a, d), Cauchy stress and plastic strain (e, q, s), peeq (e, q); contact forces (c, d) and gaps
    (c,) of all candidates; displacement du (a, d), length in pseudo-time and flow of the increment that led here, the
    length zero if the body rested in it and touched nothing. Gaps and du are stored as found, because a small travel is
    lost in the round-off of positions. ``translation`` (m,) is the displacement since rest of tools along their
    driving force, or for moments the arc of their lever (:mod:`bipot.scene.drives`); ``translated`` (m,) is that of the
    increment that led here. Arrays are read-only; states are equal where all their numbers are.

    Raises:
        SceneError: an array that is not of numbers or has another number of axes, a wrong type.
    """

    tau: float
    nodes: Floats
    stress: Floats
    plastic_strain: Floats
    peeq: Floats
    forces: Floats
    gap: Floats
    du: Floats
    translation: Floats
    translated: Floats
    length: float = 0.0
    flow: Flow | None = None

    def __post_init__(self) -> None:
        make_arrays(self, "state.", **ARRAYS)
        make_floats(self, "tau", "length", of="state.")
        require_type(self.flow, Flow, "state.flow", optional=True)

    def __repr__(self) -> str:
        """One line, without the arrays."""
        return f"State(tau={self.tau:.6g}, {len(self.nodes)} nodes, {len(self.forces)} candidates)"

    @property
    def velocity(self) -> Floats:
        """du/dtau (a, d) of the increment that led here, zero at rest."""
        return self.du / self.length if self.length > 0 else np.zeros_like(self.du)

    @property
    def mises(self) -> Floats:
        """Equivalent stress of von Mises (e, q)."""
        return equivalent_stress(self.stress)

    @property
    def pressure(self) -> Floats:
        """Mean pressure -σ_kk / 3 (e, q)."""
        return -trace(self.stress) / 3

    @property
    def rates(self) -> Floats:
        """The velocity node by node, then d translation/dtau, (a d + m,); zero at rest."""
        rates = self.translated / self.length if self.length > 0 else np.zeros_like(self.translated)
        return np.concatenate([self.velocity.ravel(), rates])


def rest(scene: Scene, gap: Floats) -> State:
    """The stress-free state at tau = 0 with the candidates' ``gap`` (c,)."""
    nodes = scene.mesh.nodes
    points = len(scene.mesh.elements), len(tabulated(scene.mesh.element, scene.rule).weights)
    tensor = np.zeros((*points, scene.geometry.reduction.mandel))
    forces = np.zeros((len(gap), nodes.shape[1]))
    return State(
        tau=0.0,
        nodes=nodes,
        stress=tensor,
        plastic_strain=tensor,
        peeq=tensor[..., 0],
        forces=forces,
        gap=gap,
        du=np.zeros_like(nodes),
        translation=np.zeros(len(scene.drives)),
        translated=np.zeros(len(scene.drives)),
    )
