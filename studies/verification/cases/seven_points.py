"""The rule of seven points on the square."""

from __future__ import annotations

from bipot.fem.elements import radon7
from studies.verification.case import Asked, Case, Subject, Watch

DEGREE = 5


def moment(i: int, j: int) -> float:
    """Integral of x^i y^j over [-1, 1]^2."""
    return (2 / (i + 1) if i % 2 == 0 else 0.0) * (2 / (j + 1) if j % 2 == 0 else 0.0)


def integral(i: int, j: int) -> float:
    """The rule's."""
    points, weights = radon7()
    return float(weights @ (points[:, 0] ** i * points[:, 1] ** j))


def run(points: int, watch: Watch) -> list[float]:
    """The largest error of the monomials that are exact, and x^6, which is not."""
    exact = [(i, j) for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)]
    return [max(abs(integral(i, j) - moment(i, j)) for i, j in exact), integral(6, 0)]


CASE = Case(
    name="seven_points",
    subject=Subject.ELEMENTS,
    source="published: Radon 1948; Stroud's C2:5-1",
    purpose="The quadrature of the seed paper's element is of degree five and not higher.",
    setup=(
        "All 21 monomials of degree five or less on [-1, 1]^2. The first that fails is x^6, with 12/25 instead of "
        "the integral 4/7. The two points on an axis lie on the second one."
    ),
    asked=(Asked("largest error up to degree 5", 0.0, 1e-15), Asked("x^6", 12 / 25, 1e-14)),
    counted="points",
    meshes=(7,),
    run=run,
    marched=False,
)
