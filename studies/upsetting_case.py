"""The main study's choices: its command line, what each run is asked, and the scene that follows."""

from __future__ import annotations

import argparse
from dataclasses import dataclass

from bipot.fem.elements import RULES
from bipot.forms import FormName
from bipot.meshes.layout import Layout
from bipot.paper import upsetting
from bipot.scene.scene import Scene
from bipot.tools.tool import Sampling
from studies.element_types import ElementType
from studies.upsetting_march import Upset
from studies.upsetting_options import Options, Size, sampling_of

OPTIONS = Options(
    name="upsetting",
    about="Upset the cylinder of the seed paper.",
    default=Size(elements=10, increments=45),
    fast=Size(elements=4, increments=6),
    reduction=0.45,
    form=FormName.TANGENT,
)


@dataclass(frozen=True, kw_only=True)
class Case(Upset):
    """One run of the cylinder."""

    element: ElementType
    layout: Layout
    sampling: Sampling
    diameter: float = 10.0

    def scene(self) -> Scene:
        """The cylinder; raises SceneError on bad input."""
        return upsetting(
            mu=self.mu,
            reduction=self.reduction,
            height=self.height,
            diameter=self.diameter,
            young=self.young,
            poisson=self.poisson,
            hardening=self.curve(),
            elements=self.elements,
            element=self.element.element,
            volume=self.element.volume,
            quadrature=self.quadrature,
            configuration=self.configuration,
            layout=self.layout,
            sampling=self.sampling,
        )


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = OPTIONS.parser()
    kinds = [kind.value for kind in ElementType]
    p.add_argument("--element-type", choices=kinds, default=ElementType.Q8.value, help="q8 (default) is the paper's")
    rules = sorted({rule.value for kind in ElementType for rule in RULES[kind.element]})
    p.add_argument("--quadrature", choices=rules, help="default the element's own: radon7 of q8, the paper's")
    corner = "fanned: two elements in the corner (default %(default)s)"
    layouts = [layout.value for layout in Layout]
    p.add_argument("--layout", choices=layouts, default=Layout.TENSOR.value, help=corner)
    posed = "where contact is posed (default %(default)s)"
    samplings = [sampling.value for sampling in Sampling]
    p.add_argument("--sampling", choices=samplings, default=Sampling.NODES.value, help=posed)
    p.add_argument("--beside", action="store_true", help="run q4p0 at the same node spacing, too, in OUT/q4p0")
    p.add_argument("--diameter", type=float, default=10.0, help="of the cylinder, mm (default 10)")
    return p


def cases(arguments: argparse.Namespace) -> list[Case]:
    """One case a coefficient; raises SceneError naming an option that would have no effect."""
    asked = OPTIONS.common(arguments, ElementType(arguments.element_type))
    layout = Layout(arguments.layout)
    sampling = sampling_of(arguments, ElementType(arguments.element_type).element)
    return [Case(mu=mu, layout=layout, sampling=sampling, diameter=arguments.diameter, **asked) for mu in arguments.mu]
