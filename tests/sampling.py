"""det J by sampling, from shape functions of its own: what the library's bounds are compared with, and its refusals."""

import numpy as np

from bipot.errors import InvertedElement
from bipot.fem.orientation import refuse_folded
from bipot.fem.reduction import Geometry


def grid(count):
    """Points (count^2, 2) of the unit square, its edges and corners among them."""
    t = np.linspace(0, 1, count)
    return np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)


def determinants(x, points):
    """det J (e, p) of eight-node elements x (e, 8, 2) at points (p, 2), or each at its own (e, p, 2), of [0, 1]^2."""
    s, t = np.moveaxis(2 * np.broadcast_to(points, (len(x), *points.shape[-2:])) - 1, -1, 0)
    columns = []
    for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        columns.append((a * (1 + b * t) * (2 * a * s + b * t) / 2, b * (1 + a * s) * (2 * b * t + a * s) / 2))
    for a, b in ((0, -1), (1, 0), (0, 1), (-1, 0)):
        across = (-2 * s * (1 + b * t), (1 - s**2) * b)
        columns.append(across if a == 0 else (a * (1 - t**2), -2 * t * (1 + a * s)))
    along, up = (np.array([column[k] for column in columns]) for k in (0, 1))
    J = np.einsum("eka,bkep->abep", x, np.array([along, up]))
    return J[0, 0] * J[1, 1] - J[0, 1] * J[1, 0]


def triangle_grid(count):
    """Points of the triangle below the diagonal of the unit square, its edges and corners among them."""
    points = grid(count)
    return points[points.sum(axis=1) <= 1 + 1e-12]


def slopes(element, points):
    """d/ds and d/dt (2, k, p) of the shapes of T3, T6, Q4 and Q9 at points (p, 2), from their usual formulas."""
    s, t = points.T
    one, none = np.ones_like(s), np.zeros_like(s)
    if element.corners == 3:
        L, both = (1 - s - t, s, t), ((-one, one, none), (-one, none, one))
        if not element.quadratic:
            return np.array(both)
        corner = [[d[k] * (4 * L[k] - 1) for k in range(3)] for d in both]
        middle = [[4 * (d[a] * L[b] + L[a] * d[b]) for a, b in ((0, 1), (1, 2), (2, 0))] for d in both]
        return np.array([corner[k] + middle[k] for k in range(2)])
    if element.quadratic:
        shape = {
            0: (lambda x: (1 - x) * (1 - 2 * x), lambda x: 4 * x - 3),
            0.5: (lambda x: 4 * x * (1 - x), lambda x: 4 - 8 * x),
            1: (lambda x: x * (2 * x - 1), lambda x: 4 * x - 1),
        }
        places = [(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5), (0.5, 0.5)]
    else:
        shape = {0: (lambda x: 1 - x, lambda x: -1 + 0 * x), 1: (lambda x: x, lambda x: 1 + 0 * x)}
        places = [(0, 0), (1, 0), (1, 1), (0, 1)]
    first = [shape[a][1](s) * shape[b][0](t) for a, b in places]
    return np.array([first, [shape[a][0](s) * shape[b][1](t) for a, b in places]])


def determinants_of(element, x, points):
    """det J (e, p) of elements x (e, k, 2) at points (p, 2) of the reference shape."""
    J = np.einsum("eka,bkp->abep", x, slopes(element, points))
    return J[0, 0] * J[1, 1] - J[0, 1] * J[1, 0]


def refusal(x, geometry=Geometry.PLANE_STRAIN, straight=False):
    """What is said of one element (k, 2), or an empty string."""
    try:
        refuse_folded({"here": x}, np.arange(len(x))[None], geometry, straight=straight)
    except InvertedElement as inverted:
        return str(inverted)
    return ""
