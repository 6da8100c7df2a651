"""How contact forces change as nodes go along curved tools, taken off the stiffness of an element that has the node."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bipot.meshes.mesh import Mesh
from bipot.typing import Bools, Floats, Ints


@dataclass(frozen=True)
class Bent:
    """Of the ``parts`` (b,) at curved tools the ``element`` (b,) of each one's node, and its unknowns ``dofs`` (b, d).

    Which of its elements is all the same: they are summed. Where the tools are driven (:mod:`bipot.contact.coupling`)
    is another matter.
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
        """Take derivatives of the parts' forces by their places, ``bending`` (w, d, d), off element matrices K."""
        at = self.element[:, None, None], self.dofs[:, :, None], self.dofs[:, None, :]
        np.subtract.at(K, at, bending[self.parts])
