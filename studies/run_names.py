"""What a run is called in tables and figures, from what it says of itself: its element, and what is unusual in it."""

from __future__ import annotations

from bipot.fem.elements import RULES, Quadrature
from bipot.fem.projection import VolumeChange
from bipot.forms import FormName
from bipot.meshes.elements import Element
from bipot.meshes.layout import Layout
from bipot.results import History
from bipot.tools.tool import Sampling


def element_of(run: History) -> str:
    """Element, representation of the volume change, and what is not the element's own: rule, layout, sampling, law.

    One word, such as ``Q8`` (the paper's) or ``Q8/P1,gauss2,fanned``.
    """
    element, volume = Element(run.scene["element"]), VolumeChange(run.scene["volume"])
    projected = "" if volume is VolumeChange.AS_IS else f"/{volume.name}"
    usual = {RULES[element][0].value, Layout.TENSOR.value, Sampling.NODES.value}
    said = (run.scene["quadrature"], run.parameters.get("layout"), run.scene["tools"][0]["sampling"])
    others = [str(word) for word in said if word is not None and word not in usual]
    # The one form that poses another law.
    others += [FormName.PENALTY.value] * (run.parameters.get("form") == FormName.PENALTY.value)
    return ",".join([f"{element.name}{projected}", *others])


def side_of(run: History) -> int | None:
    """Elements along a side, where the run tells them."""
    return run.parameters.get("elements")


def name_of(run: History) -> str:
    """Its mesh in words."""
    side, count = side_of(run), len(run.mesh.elements)
    return f"{element_of(run).replace(',', ', ')}, {f'{count} elements' if side is None else f'{side} a side'}"


def friction_of(mu: float) -> str:
    """A coefficient in as few digits as tell it from any other.

    >>> [friction_of(mu) for mu in (0.3, 0.10000001, float("inf"))]
    ['0.3', '0.10000001', 'inf']
    """
    short = f"{mu:g}"
    return short if float(short) == mu else repr(mu)


def is_papers(run: History) -> bool:
    """Whether element, rule, mesh and sampling are those of the seed paper: 10 x 10 Q8 with seven points, at nodes."""
    papers = Element.Q8.value, VolumeChange.AS_IS.value, Quadrature.RADON7.value, Sampling.NODES.value, 100
    own = (*(run.scene[name] for name in ("element", "volume", "quadrature")), run.scene["tools"][0]["sampling"])
    return (*own, len(run.mesh.elements)) == papers
