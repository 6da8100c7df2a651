r"""The cap of friction by the shear yield stress of the body at its contacts, |r_t| <= min(mu r_n, cap).

    cap_p = m_p sum_e w_e k_e A_ep,    k_e = <sigma_Y(p)>_e / sqrt 3,

over the facets e of the tool's boundaries, edges or faces, at the point p. sigma_Y is the hardened yield stress at the
end of the increment, and <.>_e its mean over the volume of the element behind the facet. A_ep >= 0 is the point's share
of the facet's area in the configuration of equilibrium:

    at nodes    int N_p dA (on straight quadratic edges 1, 4, 1 sixths of the length, and 0 on the axis); on facets
                where one of these is negative, as at corners of quadratic faces or with a middle node out of place,
                max(int N_p dA, 0) times a factor that keeps the sum,
    weighted    int psi_p dA > 0 (:mod:`bipot.contact.sampling`),
    deformable  int N_p dA over what faces the other side of the straight parts of edges, or of faces.

A facet counts to the extent that it lies on the tool, w_e = min(max(1 - s/LIES, 0), 1), with s the slope by which it
leaves the tool. For an edge of length h, s = g/h with g the largest gap of its points. For a face s is the slope of the
steepest direction, whatever the extent in the other: g_min/h, with h the largest distance of its ends, plus the largest
|g_p - g_q|/|x_p - x_q| of two of its points (half of that unless both are ends). Thus a free side that meets a punch at
a corner adds nothing to the area there; a side that folds onto the punch is added without a jump; and an edge of which
one node has reached a circle counts in part.

A cap belongs to an iterate and is frozen in the pass that begins there. It depends on the displacement only through
area and hardening, which change as the strain does. The certificate checks the law with the cap of the iterate that it
judges.
"""

from __future__ import annotations

import numpy as np

from bipot.contact.candidates import Candidates
from bipot.tensors import norm
from bipot.typing import Floats, Ints

LIES = 0.25
"""A facet that leaves the tool by this slope or more does not lie on it."""


def strength(yield_stress: Floats, volume: Floats) -> Floats:
    """Shear yield stress k (e,) of elements, the mean over points with a ``yield_stress`` and ``volume`` (e, q)."""
    return np.vecdot(yield_stress, volume) / (np.sqrt(3.0) * volume.sum(axis=1))


def caps(
    candidates: Candidates, peeq: Floats, volume: Floats, balanced: Floats, nodes: Floats, placed: Floats
) -> Floats:
    """Largest friction forces (c,) by the shear yield stress at ``peeq`` (e, q), inf where there is no cap.

    Areas and the ``volume`` (e, q) of points are those of the configuration ``balanced`` (a, d), gaps those of
    ``nodes`` (a, d) to tools in the poses ``placed`` (k, p).
    """
    scene, ends = candidates.scene, candidates.scene.mesh.element.ends
    k = strength(scene.materials.yield_stress(peeq), volume)
    carried = [np.zeros(len(points.node)) for points in candidates.points]
    for number, (tool, points, pose) in enumerate(zip(scene.tools, candidates.points, placed, strict=True)):
        # Beneath others the yield stress may be infinite.
        if not tool.capped:
            continue
        facets, areas = points.facets, points.areas(balanced, scene.geometry)
        if points.faced is None:
            boundary = np.unique(facets)
            gaps = np.zeros(len(nodes))
            gaps[boundary] = tool.distance(nodes[boundary], pose)
            gap = np.asarray(points.weights @ gaps)[points.point]
        else:
            # That the end of the other side is rounded is no gap. Of what faces nothing the area is zero.
            means = points.weights @ nodes
            gap = (points.faced.gap(means, means) - points.faced.apart)[points.point]
            areas *= points.faced.shares
        # All means are at the ends of facets; between parts facets are flat parts of them.
        at = facets[:, ends] if points.weighted else facets
        outer = ends if at.shape[1] > len(ends) else np.arange(at.shape[1])
        owners = scene.mesh.owners(*tool.candidates)
        strong = lying(nodes[at], gap, outer) * k[np.repeat(owners, len(facets) // len(owners))]
        np.add.at(carried[number], points.point, strong[:, None] * areas)
    bounded = np.isfinite(candidates.shear)
    return np.where(bounded, np.where(bounded, candidates.shear, 0.0) * candidates.of_points(*carried), np.inf)


def lying(x: Floats, gap: Floats, ends: Ints) -> Floats:
    """w_e (f,): how far facets with points at x (f, p, d), ``ends`` (k,) among them, and gaps (f, p) lie on a tool.

    Facets without length, which trial iterates may have, do not.

    >>> steep = np.array([[[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]]])
    >>> lying(steep, np.array([[0.0, 0.05, 0.2]]), np.array([0, 2])).round(12).tolist()
    [0.2]
    """
    outer = x[:, ends]
    chord = norm(outer[:, :, None] - outer[:, None]).max(axis=(1, 2))
    steep = _over(gap.max(axis=1), chord) if len(ends) == 2 else _over(gap.min(axis=1), chord) + _slope(x, gap, ends)
    return np.clip(1.0 - steep / LIES, 0.0, 1.0)


def _slope(x: Floats, gap: Floats, ends: Ints) -> Floats:
    """The largest slope (f,) of the gap of faces from one of their points to another, as in :func:`lying`."""
    end = np.isin(np.arange(x.shape[1]), ends)
    apart, rises = norm(x[:, :, None] - x[:, None]), np.abs(gap[:, :, None] - gap[:, None])
    rises = np.where(end[:, None] & end, 1.0, 0.5) * rises
    slopes = np.divide(rises, apart, out=np.where(rises > 0, np.inf, 0.0), where=apart > 0)
    return np.asarray(slopes.max(axis=(1, 2)))


def _over(gap: Floats, length: Floats) -> Floats:
    """Gaps over lengths (f,); inf where the length is zero."""
    return np.divide(gap, length, out=np.full_like(length, np.inf), where=length > 0)
