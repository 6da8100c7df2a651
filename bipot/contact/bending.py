"""The change of contact forces as nodes move along curved tools, subtracted from the stiffness of an element."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.meshes.mesh import Mesh
from bipot.typing import Bools, Floats, Ints


@dataclass(frozen=True)
class Bent:
    """The ``parts`` (b,) at curved tools, an ``element`` (b,) of each one's node, and its unknowns ``dofs`` (b, d).

    Any element of the node will do, because elements are summed. Driven tools are treated in
    :mod:`bipot.contact.coupling`.
    """

    parts: Ints
    element: Ints
    dofs: Ints

    @staticmethod
    def of(mesh: Mesh, node: Ints, curved: Bools) -> Bent:
        """Those of parts at these nodes (w,), of which some are at ``curved`` (w,) tools."""
        parts = np.flatnonzero(curved)
        _, first = np.unique(mesh.elements, return_index=True)
        element, local = np.divmod(first[node[parts]], mesh.elements.shape[1])
        return Bent(parts, element, mesh.dimension * local[:, None] + np.arange(mesh.dimension))

    def take_off(self, K: Floats, bending: Floats) -> None:
        """Subtract the derivatives ``bending`` (w, d, d) of the parts' forces by position from element matrices K."""
        at = self.element[:, None, None], self.dofs[:, :, None], self.dofs[:, None, :]
        np.subtract.at(K, at, bending[self.parts])
