"""What ``docs/theory.md`` and the README quote of the same results: the mesh in the paper's case, and Hertz."""

from __future__ import annotations

from studies.quoted.filling import Quoted
from studies.quoted.results import Results, digits, percent, within


def _force(results: Results, mu: float, elements: float) -> float:
    """At 45 % on a mesh of so many elements a side."""
    return results.one("convergence", "force_45_N", mu=mu, knob="elements", value=elements)


def mesh_effect(results: Results, mu: float, coarse: float = 10.0, fine: float = 20.0) -> float:
    """By what part the force changes from one mesh to the next finer one."""
    return abs(_force(results, mu, fine) / _force(results, mu, coarse) - 1)


def _with_friction(results: Results, elements: float) -> float:
    """By what part the force is larger at mu = 0.3 than at mu = 0.1."""
    return _force(results, 0.3, elements) / _force(results, 0.1, elements) - 1


def _no_order(results: Results) -> bool:
    """At mu = 0.3 the force goes down and up again with the mesh."""
    coarse, middle, fine = (_force(results, 0.3, n) for n in (5.0, 10.0, 20.0))
    return (middle - coarse) * (fine - middle) < 0


def falls_with_friction(results: Results) -> bool:
    """On the paper's mesh the force falls with mu, on the finer one it rises."""
    return _with_friction(results, 10.0) < 0 < _with_friction(results, 20.0)


def _hertz(results: Results, case: str, *quantities: str) -> str:
    """What errors are within on the finest mesh, in per cent."""
    rows = results.rows("verification", case=case, quantity=quantities)
    finest = max(float(row["mesh"]) for row in rows)
    return digits(100 * max(within(float(row["error"]), 2) for row in rows if row["mesh"] == finest))


QUOTED = Quoted(
    values={
        "cylinder": lambda results: _hertz(
            results, "hertz_cylinder", "a over its closed form", "p0 over its closed form"
        ),
        "approach": lambda results: _hertz(results, "hertz_cylinder", "approach over its closed form"),
        "sphere_force": lambda results: _hertz(results, "hertz_sphere", "F"),
        "sphere_pressure": lambda results: _hertz(results, "hertz_sphere", "p0"),
        "sphere_radius": lambda results: _hertz(results, "hertz_sphere", "a"),
        "falls": lambda results: percent(-_with_friction(results, 10.0), 1),
        "rises": lambda results: percent(_with_friction(results, 20.0)),
        "mesh_least": lambda results: percent(min(mesh_effect(results, 0.3, 5.0, 10.0), mesh_effect(results, 0.3)), 1),
        "mesh_most": lambda results: percent(max(mesh_effect(results, 0.3, 5.0, 10.0), mesh_effect(results, 0.3)), 1),
    },
    claims={
        "On the paper's mesh the certified force at 45 % falls with mu": falls_with_friction,
        "no order is observed": _no_order,
    },
)

README = Quoted(
    values={
        "mesh_01": lambda results: percent(mesh_effect(results, 0.1), 1),
        "mesh_03": lambda results: percent(mesh_effect(results, 0.3), 1),
    },
    claims={"on the paper's mesh it even falls with mu": falls_with_friction},
)
