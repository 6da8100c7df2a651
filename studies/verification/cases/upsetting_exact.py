"""Frictionless upsetting of the seed paper's cylinder: the exact elastoplastic answer."""

from __future__ import annotations

from bipot import Schedule, upsetting
from studies.closed_forms import PAPER
from studies.verification.case import Asked, Case, Subject, Watch

REDUCTIONS = (0.10, 0.30, 0.45, 0.60)


def run(increments: int, watch: Watch) -> list[float]:
    """Force, outer radius and largest plastic strain at every reduction."""
    last = REDUCTIONS[-1]
    scene = upsetting(mu=0.0, reduction=last, elements=2)
    schedule = Schedule(increments, landings=tuple(reduction / last for reduction in REDUCTIONS[:-1]))
    out = list[float]()
    for accepted in watch.march(scene, schedule):
        if any(abs(accepted.state.tau * last - reduction) < 1e-9 for reduction in REDUCTIONS):
            force, radius = -accepted.tool_force(0)[1], accepted.state.nodes[:, 0].max()
            out += [float(force), float(radius), float(accepted.peeq.max())]
    return out


CASE = Case(
    name="upsetting_exact",
    subject=Subject.UPSETTING,
    source="closed form: homogeneous deformation in logarithmic strain",
    purpose=(
        "A homogeneous solution is independent of the mesh: the error is that of the increments, in flow and geometry."
    ),
    setup=(
        "Cylinder 10 mm high, 10 mm wide, E = 210000 MPa, nu = 0.3, sigma_Y = 300 MPa, perfect plasticity, between "
        "rigid punches without friction, to 60 %; 2 x 2 Q8 of the quarter with seven points, as in the seed paper. "
        "With eps = -ln(1 - reduction): eps_p = eps - sigma_Y/E, R = R0 exp(eps_p/2 + nu sigma_Y/E), F = sigma_Y pi "
        "R^2."
    ),
    asked=tuple(
        Asked(f"{name} at {100 * reduction:.0f} %", float(exact(reduction)), 1e-4)
        for reduction in REDUCTIONS
        for name, exact in (("F", PAPER.exact_force), ("R", PAPER.exact_radius), ("eps_p", PAPER.plastic_strain))
    ),
    counted="increments",
    meshes=(12, 24, 48, 96),
    run=run,
)
