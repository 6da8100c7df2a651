"""What a march yields: an accepted increment, its results by name, how it was found and what it cost."""

from __future__ import annotations

from dataclasses import dataclass

from bipot.control.course import Course
from bipot.control.reason import Reason
from bipot.energy import Energies
from bipot.errors import require, require_count
from bipot.fem.reduction import Components
from bipot.forms import FormName
from bipot.increment import Solved
from bipot.programs.data import Units
from bipot.scene.scene import Scene
from bipot.scene.symmetry import share, whole_force
from bipot.state import State
from bipot.traction import ContactTraction, traction
from bipot.typing import Floats


@dataclass(frozen=True, eq=False, repr=False)
class Accepted:
    """One accepted increment: its start, its result, how it was solved and what it cost.

    ``course`` is the march after it, which :func:`bipot.marching.march` can continue. ``tool_forces`` (k, d) are those
    of the tools on the modelled part. ``passes`` includes those of failed attempts; ``reasons`` say why a fallback was
    used or the increment was cut, ``strayed`` whether it was cut or a suited form failed. ``landed`` is the node at
    whose landing the increment was cut (:mod:`bipot.control.landing`), or None. Results by name are values at the
    increment's end, at nodes (a, d) or integration points (e, q).

    >>> from bipot import Schedule, march, upsetting
    >>> accepted = next(march(upsetting(mu=0.1, elements=1), Schedule(100)))
    >>> accepted.stress.names
    ('rr', 'zz', 'tt', 'rz')
    >>> bool((accepted.stress["zz"] < 0).all()), accepted.displacement.shape
    (True, (8, 2))
    """

    start: State
    course: Course
    solved: Solved
    tool_forces: Floats
    form: FormName
    passes: int
    cuts: int
    reasons: tuple[Reason, ...]
    seconds: float
    landed: int | None = None
    strayed: bool = False

    def __repr__(self) -> str:
        """In one line, without fields."""
        forces = self.tool_forces.tolist()
        return f"Accepted({self.number}: tau={self.state.tau:.6g}, {self.form.value}, {self.passes} passes, {forces=})"

    @property
    def number(self) -> int:
        """The increment's number in the march, from 1."""
        return self.course.number

    @property
    def state(self) -> State:
        """The state at the increment's end."""
        return self.course.state

    @property
    def energies(self) -> Energies:
        """The energies of the whole body since the start, this increment included."""
        return self.course.energies

    @property
    def reason(self) -> str:
        """Why a fallback was used or the increment was cut, in words."""
        return "; ".join(map(str, self.reasons))

    @property
    def traction(self) -> ContactTraction:
        """Recovered tractions and status of all candidates, on the configuration of equilibrium."""
        return traction(self.solved.iterate, self.solved.r)

    @property
    def poses(self) -> Floats:
        """Pose (k, p) of each tool (:mod:`bipot.tools.poses`)."""
        return self.scene.placed(self.state.tau, self.state.translation)

    def tool_pose(self, tool: int) -> Floats:
        """Pose (3,) of a tool, in space (6,): displacement since rest, of its centre where it turns, and rotation.

        Raises:
            SceneError: ``tool`` is not the number of a tool.
        """
        self._require_tool(tool)
        return self.poses[tool]

    def tool_moment(self, tool: int) -> float:
        """Moment of a turning tool on the whole body, about its centre or axis, anticlockwise; 0 if it does not turn.

        Raises:
            SceneError: ``tool`` is not the number of a tool.
        """
        self._require_tool(tool)
        modelled = float(self.solved.iterate.tool_moments(self.solved.r)[tool])
        return modelled / share(self.scene.planes, self.scene.tools[tool])

    def tool_force(self, tool: int) -> Floats:
        """Force (d,) of a tool, given by its number, on the whole body, parts beyond planes of symmetry included.

        On a meridian it is that of the full ring, without a radial component; in plane strain per unit of thickness.

        Raises:
            SceneError: ``tool`` is not the number of a tool.
        """
        scene = self.scene
        self._require_tool(tool)
        return whole_force(scene.planes, scene.geometry, scene.tools[tool], self.tool_forces[tool])

    @property
    def reactions(self) -> Floats:
        """Forces (a, d) of the supports on the nodes of the modelled body."""
        return self.solved.iterate.reactions(self.solved.r)

    @property
    def unique(self) -> bool:
        """Whether the answer is locally unique (nothing is undetermined) and the first suited form found it at once.

        An answer found after failures and cuts may be one of several exact answers to a long increment.
        """
        return not self.solved.undetermined and not self.strayed

    @property
    def displacement(self) -> Floats:
        """The displacement (a, d) since rest, nodes minus those of the mesh, to within the round-off of positions.

        ``state.du`` is the displacement of this increment alone, to within its own, smaller, round-off.
        """
        return self.state.nodes - self.scene.mesh.nodes

    @property
    def stress(self) -> Components:
        """Cauchy stress, ``stress["rz"]`` (e, q)."""
        return Components(self.state.stress, self.scene.geometry)

    @property
    def plastic_strain(self) -> Components:
        """Plastic strain, turned with the body, ``plastic_strain["zz"]`` (e, q)."""
        return Components(self.state.plastic_strain, self.scene.geometry)

    @property
    def peeq(self) -> Floats:
        """Equivalent plastic strain (e, q)."""
        return self.state.peeq

    @property
    def mises(self) -> Floats:
        """Equivalent stress of von Mises (e, q)."""
        return self.state.mises

    @property
    def pressure(self) -> Floats:
        """Mean pressure -σ_kk / 3 (e, q)."""
        return self.state.pressure

    @property
    def units(self) -> Units:
        """Units of length, force and stress in which the increment's programs are dimensionless."""
        return self.solved.iterate.increment.units

    def _require_tool(self, tool: int) -> None:
        require_count(tool, "tool", 0)
        count = len(self.scene.tools)
        require(tool < count, "tool", tool, f"in [0, {count}), the scene's tools")

    @property
    def scene(self) -> Scene:
        """The scene that is marched."""
        return self.solved.iterate.increment.system.body.scene
