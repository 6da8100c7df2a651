"""Assembly on a sparsity pattern computed once: a :class:`Space` maps element arrays to the free unknowns.

Unknowns are numbered node by node, (node, axis), along the axes of each node (:mod:`bipot.fem.axes`); ``free`` lists
those that no support holds. They are followed by the coordinates of tools driven by forces or moments, which appear in
contact rows only and in no element. Their couplings with nodes at curved tools are summed like elements, each with the
unknowns of a node and its tool. Outside of a :class:`Space`, element arrays and nodal fields are in coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import null_space

from bipot.fem.axes import STRAIGHT, Axes
from bipot.fem.elements import Quadrature, Reference, tabulated
from bipot.fem.kinematics import Gradients, gradients
from bipot.fem.reduction import Geometry
from bipot.meshes.mesh import Mesh
from bipot.tensors import contract
from bipot.typing import Floats, Ints

UNCOUPLED = np.empty((0, 1), dtype=np.intp)

WHOLE = np.zeros(1, dtype=np.intp)
"""The number of the part of all nodes of a body that is one."""


@dataclass(frozen=True)
class Space:
    """Displacements of a mesh under supports, with the pattern of the stiffness on the free unknowns.

    ``dofs`` (e, dk) numbers an element's unknowns, ``free`` (n,) the free ones among all, and ``scatter`` sends
    each entry of the element matrices to its place in the CSC data (the last place collects held unknowns).
    ``translations`` m is the number of unknowns behind the free ones, each with its place ``diagonal`` (m,) in the
    data, which elements leave zero. The entries of couplings follow those of elements in ``scatter``. Unknowns are
    components along the ``axes``.
    """

    mesh: Mesh
    geometry: Geometry
    reference: Reference
    dofs: Ints
    free: Ints
    position: Ints
    scatter: Ints
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]
    diagonal: Ints
    translations: int = 0
    axes: Axes = STRAIGHT

    @property
    def size(self) -> int:
        """Number n of unknowns."""
        return len(self.free) + self.translations

    def gradients(self, nodes: Floats) -> Gradients:
        """See :func:`bipot.fem.kinematics.gradients`: on the configuration ``nodes`` (a, d), without projection."""
        return gradients(nodes, self.mesh.elements, self.reference, self.geometry)

    def spread(self, x: Floats) -> Floats:
        """Nodal field (a, d) from the unknowns (n,), zero where held."""
        full = np.zeros(self.mesh.nodes.size)
        full[self.free] = x[: len(self.free)]
        return self.axes.field(np.asarray(full, dtype=np.float64).reshape(self.mesh.nodes.shape))

    def beside(self, x: Floats) -> Floats:
        """The coordinates of tools (m,) among the unknowns (n,)."""
        return x[len(self.free) :]

    def gather(self, every: Floats) -> Floats:
        """Unknowns (n,) of a vector (a d + m,) for all nodes, held or not, and then the coordinates of tools."""
        if self.axes.turned:
            every = every.copy()
            nodal = every[: self.mesh.nodes.size].reshape(self.mesh.nodes.shape)
            every[: self.mesh.nodes.size] = self.axes.components(nodal).ravel()
        free = every[self.free]
        return np.concatenate([free, every[self.mesh.nodes.size :]]) if self.translations else free

    def matrix(self, element: Floats) -> sp.csc_matrix:
        """Sum element matrices (e, dk, dk), or all entries as :meth:`along` takes them, into a matrix (n, n)."""
        place, weights = self.scatter[: element.size], self.along(element)
        data = np.bincount(place, weights=weights, minlength=len(self.indices) + 1)[:-1]
        return sp.csc_matrix((data, self.indices, self.indptr), shape=(self.size, self.size))

    def along(self, element: Floats) -> Floats:
        """Entries (s,) of element matrices (e, dk, dk) by components along the axes.

        Entries of couplings may follow, all in one row, already in these components.
        """
        if not self.axes.turned:
            return element.ravel()
        (turned, turn), out = self._turns, element.ravel().copy()
        count, width = self.dofs.shape
        matrices = out[: count * width**2].reshape(count, width, width)
        matrices[turned] = turn @ matrices[turned] @ turn.transpose(0, 2, 1)
        return out

    @cached_property
    def _turns(self) -> tuple[Ints, Floats]:
        """Elements (t,) with nodes that have axes of their own, and the rotation (t, dk, dk) of their unknowns."""
        count, d = self.mesh.nodes.shape
        rows = self.axes.frames(count, d)
        turned = np.flatnonzero(np.isin(self.mesh.elements, self.axes.nodes).any(axis=1))
        nodes = self.mesh.elements[turned]
        turn = np.zeros((len(turned), nodes.shape[1], d, nodes.shape[1], d))
        for k in range(nodes.shape[1]):
            turn[:, k, :, k] = rows[nodes[:, k]]
        return turned, turn.reshape(len(turned), d * nodes.shape[1], -1)

    def vector(self, element: Floats) -> Floats:
        """Sum element vectors (e, dk) into the vector (n,) of the unknowns."""
        nodal = self.nodal(element).ravel()
        return self.gather(np.append(nodal, np.zeros(self.translations)) if self.translations else nodal)

    def nodal(self, element: Floats) -> Floats:
        """Sum element vectors (e, dk) at the nodes (a, d), held unknowns included."""
        full = np.bincount(self.dofs.ravel(), weights=element.ravel(), minlength=self.mesh.nodes.size)
        return np.asarray(full, dtype=np.float64).reshape(self.mesh.nodes.shape)

    def operator(self, blocks: Floats) -> sp.csr_matrix:
        """Sparse operator (p m, n) from dense rows (p, m, dk) at p points, ordered element by element."""
        points, width, _ = blocks.shape
        if self.axes.turned:
            (turned, turn), blocks = self._turns, blocks.copy()
            by_element = blocks.reshape(len(self.dofs), -1, blocks.shape[2])
            by_element[turned] = by_element[turned] @ turn.transpose(0, 2, 1)
        columns = np.repeat(self.position[self.dofs], points // len(self.dofs), axis=0)
        columns = np.broadcast_to(columns[:, None, :], blocks.shape)
        kept = columns >= 0
        counts = np.concatenate([[0], np.cumsum(kept.sum(axis=2).ravel())])
        return sp.csr_matrix((blocks[kept], columns[kept], counts), shape=(points * width, self.size))

    def force_scale(self, element: Floats, applied: Floats) -> float:
        """Largest nodal sum of |element forces| (e, dk) and |applied| (a, d): the scale of residuals."""
        forces = element.reshape(*self.mesh.elements.shape, -1)
        size = np.sqrt(np.vecdot(forces, forces))
        sums = np.bincount(self.mesh.elements.ravel(), size.ravel())
        return float((sums + np.sqrt(np.vecdot(applied, applied))).max())


def space(
    mesh: Mesh,
    geometry: Geometry,
    rule: Quadrature,
    held: Ints,
    translations: int = 0,
    coupled: Ints = UNCOUPLED,
    axes: Axes = STRAIGHT,
) -> Space:
    """The space of a mesh whose unknowns ``held`` (full numbers) are zero, followed by the number of ``translations``.

    ``coupled`` (b, u) are further coupled unknowns: full numbers, translations behind the nodes', -1 for none.
    Unknowns are components along the ``axes``.
    """
    d = geometry.reduction.dimension
    dofs = (d * mesh.elements[:, :, None] + np.arange(d)).reshape(len(mesh.elements), -1)
    free = np.setdiff1d(np.arange(mesh.nodes.size), held)
    position = np.full(mesh.nodes.size, -1, dtype=np.intp)
    position[free] = np.arange(len(free))
    behind = len(free) + np.arange(translations)
    every, n = np.concatenate([position, behind, [-1]]), len(free) + translations
    rows, columns = (np.concatenate(parts) for parts in zip(*map(_entries, (every[dofs], every[coupled])), strict=True))
    kept = (rows >= 0) & (columns >= 0)
    # Column-major keys sort into CSC order.
    keys = np.append(columns[kept] * n + rows[kept], behind * (n + 1))
    unique, place = np.unique(keys, return_inverse=True)
    scatter = np.full(len(kept), len(unique), dtype=np.intp)
    scatter[kept] = place[: len(keys) - translations]
    return Space(
        mesh,
        geometry,
        tabulated(mesh.element, rule),
        dofs,
        free,
        position,
        scatter,
        (unique % n).astype(np.int32),
        np.concatenate([[0], np.cumsum(np.bincount(unique // n, minlength=n))]).astype(np.int32),
        np.asarray(place[len(keys) - translations :], dtype=np.intp),
        translations,
        axes,
    )


def _entries(local: Ints) -> tuple[Ints, Ints]:
    """Rows and columns (e u u,) of the entries of matrices on unknowns (e, u)."""
    rows, columns = np.broadcast_arrays(local[:, :, None], local[:, None, :])
    return rows.ravel(), columns.ravel()


def rigid_motions(nodes: Floats, free: Ints, geometry: Geometry, axes: Axes = STRAIGHT, part: Ints = WHOLE) -> Floats:
    """Orthonormal motions (f, m) on the ``free`` unknowns (f,) that vanish on the held ones and strain nothing.

    They are rigid motions of each ``part`` by itself, of which nodes have the numbers (a,) or all the same one.
    """
    d = nodes.shape[1]
    x = (nodes - nodes.mean(axis=0)) / (np.ptp(nodes) or 1.0)
    units = np.eye(d)
    shifts = [np.broadcast_to(axis, nodes.shape) for axis in units]
    turns = [x[:, j, None] * units[i] - x[:, i, None] * units[j] for i in range(d) for j in range(i)]
    modes = np.stack([axes.components(motion).ravel() for motion in (*shifts, *turns)], axis=1)
    if geometry is Geometry.AXISYMMETRIC:
        modes = modes[:, 1:2]
    own = np.repeat(np.broadcast_to(part, len(nodes)), d)
    held = np.setdiff1d(np.arange(len(modes)), free)
    found = [_vanishing(np.where((own == k)[:, None], modes, 0.0), free, held) for k in range(int(own.max()) + 1)]
    return np.hstack(found)


def _vanishing(modes: Floats, free: Ints, held: Ints) -> Floats:
    """Orthonormal combinations (f, m) of ``modes`` (n, k) on the ``free`` unknowns that vanish on the ``held`` ones."""
    # The triangle of a QR decomposition has the same null space, and is far smaller.
    kept = modes[free] @ null_space(np.linalg.qr(modes[held], mode="r"), rcond=1e-9) if len(held) else modes[free]
    return np.linalg.qr(kept)[0] if kept.shape[1] else kept


def element_stiffness(placed: Gradients, tangent: Floats) -> Floats:
    """K_e = sum_q w B^T C B (e, dk, dk), the quadratic term of (25); tangent (e, q, s, s) or (s, s)."""
    B = placed.B
    weighted = (tangent @ B) * placed.volume[..., None, None]
    e, _, _, n = B.shape
    return B.reshape(e, -1, n).transpose(0, 2, 1) @ weighted.reshape(e, -1, n)


def element_force(placed: Gradients, stress: Floats) -> Floats:
    """f_e = sum_q w B^T sigma (e, dk) of the stress (e, q, s), from the gradients that B is made of."""
    e, q, rows, k = placed.shape.shape
    d = placed.reduction.dimension
    row_forces = contract(stress * placed.volume[..., None], placed.reduction.row_forces)
    forces = row_forces.reshape(e, q, d, rows).transpose(0, 2, 1, 3).reshape(e, d, -1) @ placed.shape.reshape(e, -1, k)
    return forces.transpose(0, 2, 1).reshape(e, -1)
