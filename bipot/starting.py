"""A state that a march is asked to start from must be one of its scene."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bipot.errors import require, require_number
from bipot.response import State
from bipot.scene import Scene

HELD = 1e-9
"""How far (over the body size) held nodes of a start state may be from where the supports hold them: round-off."""


def require_start(start: State, at_rest: State, scene: Scene) -> None:
    """Refuse a start state of another scene: it has the arrays of this scene's state at rest, and its held nodes.

    Raises:
        SceneError: a time outside [0, 1], an array of another shape or not finite, peeq below zero, a held node
            elsewhere; the message names the field.
    """
    require_number(start.tau, "start.tau")
    require(0 <= start.tau <= 1, "start.tau", start.tau, "in [0, 1]")
    for name, value in vars(at_rest).items():
        if isinstance(value, np.ndarray):
            _require_like(getattr(start, name), value, f"start.{name}")
    if start.flow is not None:
        _require_like(start.flow.strain, at_rest.plastic_strain, "start.flow.strain")
        _require_like(start.flow.peeq, at_rest.peeq, "start.flow.peeq")
    require(bool((start.peeq >= 0).all()), "start.peeq", float(start.peeq.min()), ">= 0")
    moved = float(np.abs((start.nodes - scene.mesh.nodes).ravel()[scene.held]).max(initial=0.0))
    allowed = f"where the supports hold them, not {moved:.3g} away: is it another scene's?"
    require(moved <= HELD * scene.mesh.size, "start.nodes", "held ones", allowed)


def _require_like(given: ArrayLike, own: NDArray[np.float64], field: str) -> None:
    """The shape of the scene's own array, and finite."""
    shape = np.shape(given)
    require(shape == own.shape, field, f"of shape {shape}", f"of shape {own.shape}, as in the scene")
    require(bool(np.isfinite(np.asarray(given)).all()), field, "NaN or infinite", "finite")
