"""A step of a run read back: positions of body and tools, and every field by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from bipot.control.course import Course
from bipot.fem.reduction import Components, Geometry
from bipot.results.names import Place, Rank, component_names, meant
from bipot.results.static import Line
from bipot.results.stored import RunReader
from bipot.state import State
from bipot.typing import Floats, Ints


@dataclass(frozen=True)
class Snapshot:
    """Step number ``step`` of a run, 0 at its start and k after its k-th recorded increment, at pseudo-time ``tau``.

    Fields are read from the file when used. Their names may be those of components: "stress_zz", "displacement_r".
    """

    reader: RunReader
    geometry: Geometry
    step: int
    tau: float

    @property
    def course(self) -> Course:
        """The course of the march, which ``march(start=...)`` continues."""
        return self.reader(lambda run: run.course(self.step))

    @property
    def state(self) -> State:
        """The state of the body, its integration points included."""
        return self.course.state

    @property
    def nodes(self) -> Floats:
        """Positions (a, d) of the nodes."""
        return self.reader(lambda run: run.nodes(self.step))

    @property
    def tools(self) -> list[Line]:
        """Lines (p, d) of the tools at their positions."""
        (lines,) = self.reader(lambda run: run.tools(self.step, self.step + 1))
        return lines

    @property
    def touched(self) -> Ints:
        """The tool (a,), by its number, of which each node has gap, contact traction and status; -1 of none."""
        return self.reader(lambda run: run.touched(self.step))

    def nodal(self, name: str) -> NDArray[Any]:
        """Field of the nodes: (a,), a vector (a, 3) or a tensor (a, 6); NaN (status: -1) off the candidates.

        Stress, plastic strain and derived fields are averages (:mod:`bipot.results.fields`).
        """
        return self._field(Place.NODES, name)

    def cell(self, name: str) -> NDArray[Any]:
        """Field of the elements, an average over the volume of each: (e,) or a tensor (e, 6)."""
        return self._field(Place.ELEMENTS, name)

    def points(self, name: str) -> Any:
        """Field at the integration points as solved: (e, q), or the :class:`Components` of a tensor."""
        base, field, part = meant(Place.POINTS, name, self.geometry)
        values = getattr(self.state, base)
        if field.rank is not Rank.TENSOR:
            return values
        tensors = Components(values, self.geometry)
        return tensors[part] if part else tensors

    def _field(self, place: Place, name: str) -> NDArray[Any]:
        base, field, part = meant(place, name, self.geometry)
        values = self.reader(lambda run: run.field(place, base, self.step))
        return values[:, component_names(field, self.geometry).index(part)] if part else values
