r"""A block upset between rigid platens with exact Coulomb friction, as the eighth that three planes of symmetry leave.

    python -m studies.block --mu 0.1 0.3 --elements 8 --element-type h8p0 --reduction 0.3 --out DIR

A cube of 10 mm, E = 210 GPa, nu = 0.3, sigma_Y = 300 MPa; ``--width``, ``--depth``, ``--height`` and what
:mod:`studies.upsetting` takes of a material ask for others. For each mu the folder ``DIR/mu{mu}`` receives what that of
the cylinder does, with the same columns for the full block, and how its pressure alternates
(:mod:`studies.block_line`) besides; radii are distances from the axis of pressing. Candidates are those of the sides
too: they roll onto the platen. At mu = 0.3 an element inside a mesh between planes folds before long, at 46 % of the
height with 4 a side, at 25 % with 12; ``--layout fanned`` does not. Of quadratic elements, ``h20`` and its kin, the
law is posed in means on the upper face (``--sampling weighted``, their default: at nodes a face of theirs that is
pressed cannot be met) and at the nodes of the sides: the mean around a corner of a side comes to the platen long after
the nodes next to it have, which would go into it meanwhile. The platen is two tools then, of which the columns of the
pressure are told on the first.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace

from bipot.errors import require, require_count, require_positive
from bipot.fem.elements import RULES
from bipot.fem.reduction import Geometry
from bipot.forms import FormName
from bipot.laws.von_mises import Elasticity, VonMises
from bipot.meshes.layout import Layout, require_layout_room
from bipot.meshes.solids import brick
from bipot.results.columns import Column
from bipot.scene.scene import Scene
from bipot.scene.supports import Symmetry
from bipot.tools.tool import FlatTool, Sampling
from studies.block_line import COLUMNS
from studies.command import command
from studies.element_types import SolidType
from studies.upsetting import Planned, complete
from studies.upsetting_march import Upset
from studies.upsetting_options import Options, Size, sampling_of

OPTIONS = Options(
    name="block",
    about="Upset a block between platens, an eighth of it modelled.",
    default=Size(elements=8, increments=30),
    fast=Size(elements=3, increments=6),
    reduction=0.3,
    form=FormName.NEWTON,
)
PLANES = (Symmetry("left", 0), Symmetry("front", 1), Symmetry("base", 2))
TOP, SIDES = ("top",), ("right", "back")
CANDIDATES = (*TOP, *SIDES)


@dataclass(frozen=True, kw_only=True)
class Block(Upset):
    """One run of the block."""

    element: SolidType
    layout: Layout = Layout.TENSOR
    sampling: Sampling = Sampling.NODES
    width: float = 10.0
    depth: float = 10.0

    def scene(self) -> Scene:
        """The eighth x, y, z >= 0 of the block; raises SceneError on bad input.

        >>> (block, *_) = cases(parser().parse_args([]))
        >>> block.scene().tools[0].travel
        (0.0, 0.0, -1.5)
        """
        require(0 < self.reduction < 1, "reduction", self.reduction, "in (0, 1)")
        require_positive(width=self.width, depth=self.depth, height=self.height)
        require_count(self.elements, "elements")
        half, n, element = self.height / 2, self.elements, self.element.element
        require_layout_room((n, n, n), element, self.layout, ("elements",) * 3)
        platen = FlatTool(
            point=(0.0, 0.0, half),
            normal=(0.0, 0.0, -1.0),
            travel=(0.0, 0.0, -self.reduction * half),
            candidates=CANDIDATES,
            mu=self.mu,
        )
        tools = (platen,)
        if self.sampling is Sampling.WEIGHTED and element.quadratic:
            tools = replace(platen, candidates=TOP, sampling=self.sampling), replace(platen, candidates=SIDES)
        return Scene(
            mesh=brick(self.width / 2, self.depth / 2, half, n, n, n, element=element, layout=self.layout),
            geometry=Geometry.SOLID,
            material=VonMises(Elasticity(self.young, self.poisson), self.curve()),
            supports=PLANES,
            tools=tools,
            quadrature=self.quadrature,
            volume=self.element.volume,
            configuration=self.configuration,
        )

    def columns(self) -> list[Column]:
        """Those of the cylinder and :data:`~studies.block_line.COLUMNS`."""
        return [*super().columns(), *COLUMNS]


def parser() -> argparse.ArgumentParser:
    """The command line."""
    p = OPTIONS.parser()
    kinds, kind = [kind.value for kind in SolidType], SolidType.H8P0.value
    p.add_argument("--element-type", choices=kinds, default=kind, help="element (default %(default)s)")
    rules = sorted({rule.value for kind in SolidType for rule in RULES[kind.element]})
    p.add_argument("--quadrature", choices=rules, help="default the element's own")
    layouts = [layout.value for layout in Layout]
    about = "fanned: two elements on the edges of the upper face, three in its corner (default %(default)s)"
    p.add_argument("--layout", choices=layouts, default=Layout.TENSOR.value, help=about)
    samplings = [sampling.value for sampling in Sampling]
    p.add_argument("--sampling", choices=samplings, help="where contact is posed (default weighted on h20, else nodes)")
    p.add_argument("--width", type=float, default=10.0, help="of the block, mm (default 10)")
    p.add_argument("--depth", type=float, default=10.0, help="of the block, mm (default 10)")
    return p


def cases(arguments: argparse.Namespace) -> list[Block]:
    """One case a coefficient; raises SceneError naming an option that would have no effect."""
    asked = OPTIONS.common(arguments, SolidType(arguments.element_type))
    asked |= {"layout": Layout(arguments.layout), "sampling": _sampling(arguments)}
    asked |= {"width": arguments.width, "depth": arguments.depth}
    return [Block(mu=mu, **asked) for mu in arguments.mu]


def _sampling(arguments: argparse.Namespace) -> Sampling:
    """The one asked for, else that of the element; raises SceneError where there is no choice."""
    element = SolidType(arguments.element_type).element
    if arguments.sampling is None:
        return Sampling.WEIGHTED if element.quadratic else Sampling.NODES
    return sampling_of(arguments, element)


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run all cases."""
    asked = parser().parse_args(argv)
    return complete([Planned.of(case, asked.out, asked.policy, asked.fclib) for case in cases(asked)], asked.out)


if __name__ == "__main__":
    sys.exit(main())
