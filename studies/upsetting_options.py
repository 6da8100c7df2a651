"""The command line of every upsetting study, but for its body.

An option that the chosen form does not use is refused, not ignored.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bipot.errors import SceneError, require
from bipot.fem.elements import Quadrature
from bipot.fem.strain import Configuration
from bipot.forms import FormName
from bipot.meshes.elements import Element
from bipot.tools.tool import Sampling
from studies.element_types import AnyType
from studies.hardening_words import hardening_usage
from studies.outputs import add_options
from studies.upsetting_march import ABOUT_SOLVERS, DEFAULT_SOLVER, PAPERS_CURVE, PENALISED, ROUTED, solver_of


def sampling_of(arguments: argparse.Namespace, element: Element) -> Sampling:
    """The ``--sampling`` asked for; raises SceneError where the ``element`` leaves no choice."""
    sampling = Sampling(arguments.sampling)
    if sampling is Sampling.WEIGHTED and not element.quadratic:
        raise SceneError(f"--sampling weighted has no effect on --element-type {arguments.element_type}: it is linear")
    return sampling


@dataclass(frozen=True)
class Size:
    """Elements a side and uniform increments."""

    elements: int
    increments: int


@dataclass(frozen=True, kw_only=True)
class Options:
    """A study's own: its name, what it does, its sizes, in short too, its reduction and form unless asked."""

    name: str
    about: str
    default: Size
    fast: Size
    reduction: float
    form: FormName

    def parser(self) -> argparse.ArgumentParser:
        """The options that :meth:`common` answers, but for the element's; names are those of the library's enums."""
        default, fast, form = self.default, self.fast, self.form
        p = argparse.ArgumentParser(
            prog=f"studies.{self.name}",
            description=self.about,
            epilog=ABOUT_SOLVERS,
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        mu = "Coulomb coefficients; inf welds (default 0.1 0.3)"
        p.add_argument("--mu", type=float, nargs="+", default=[0.1, 0.3], help=mu)
        sides = f"elements a side (default {default.elements}, --fast {fast.elements})"
        p.add_argument("--elements", type=int, help=sides)
        uniform = f"uniform increments after the start-up (default {default.increments}, --fast {fast.increments})"
        p.add_argument("--increments", type=int, help=uniform)
        p.add_argument(
            "--accuracy", type=float, help="error of the force, a fraction, by which increments find their lengths"
        )
        forms = [f.value for f in FormName]
        p.add_argument(
            "--form", choices=forms, default=form.value, help="how increments are solved (default %(default)s)"
        )
        p.add_argument(
            "--solver", help=f"of tangent and dissipation: clarabel, qoco, cvxpy:NAME (default {DEFAULT_SOLVER})"
        )
        p.add_argument(
            "--configuration",
            choices=[c.value for c in Configuration],
            default=Configuration.MIDPOINT.value,
            help="where strain is measured (default %(default)s)",
        )
        reduction = "in height, in (0, 1) (default %(default)s)"
        p.add_argument("--reduction", type=float, default=self.reduction, help=reduction)
        p.add_argument("--height", type=float, default=10.0, help="of the body, mm (default 10)")
        p.add_argument("--E", type=float, default=210_000.0, help="Young's modulus, MPa (default 210000)")
        p.add_argument("--nu", type=float, default=0.3, help="Poisson's ratio (default 0.3)")
        p.add_argument("--sigma-Y", type=float, help="yield stress, MPa, of perfect plasticity (default 300)")
        p.add_argument("--hardening", help=f"a curve instead of --sigma-Y: {hardening_usage()}")
        p.add_argument("--kn", type=float, help="normal penalty, N/mm a point (default: pressure E/h; uzawa 1e4 E/h)")
        p.add_argument("--kt", type=float, help="tangential penalty, N/mm a point (default likewise)")
        p.add_argument("--fclib", action="store_true", help="write every increment's contact problem as an FCLIB file")
        p.add_argument("--fast", action="store_true", help="a small mesh and few increments")
        p.add_argument(
            "--out", type=Path, default=Path(f"results/{self.name}"), help="folder of the results (default %(default)s)"
        )
        add_options(p)
        return p

    def common(self, arguments: argparse.Namespace, kind: AnyType) -> dict[str, Any]:
        """The fields of :class:`~studies.upsetting_march.Upset` but for the coefficient, as keywords.

        Raises:
            SceneError: naming an option that would have no effect.
        """
        refuse_without_effect(arguments)
        solver_of(arguments.solver or DEFAULT_SOLVER)
        chosen = self.fast if arguments.fast else self.default
        increments = chosen.increments if arguments.increments is None else arguments.increments
        return {
            "elements": chosen.elements if arguments.elements is None else arguments.elements,
            "element": kind,
            "quadrature": kind.quadrature if arguments.quadrature is None else Quadrature(arguments.quadrature),
            "increments": increments if arguments.accuracy is None else None,
            "form": FormName(arguments.form),
            "solver": arguments.solver or DEFAULT_SOLVER,
            "configuration": Configuration(arguments.configuration),
            "reduction": arguments.reduction,
            "hardening": _curve(arguments),
            "kn": arguments.kn,
            "kt": arguments.kt,
            "accuracy": arguments.accuracy,
            "height": arguments.height,
            "young": arguments.E,
            "poisson": arguments.nu,
        }


def _curve(arguments: argparse.Namespace) -> str:
    """The hardening curve in a word."""
    if arguments.sigma_Y is not None:
        return f"perfect:{arguments.sigma_Y!r}"
    return PAPERS_CURVE if arguments.hardening is None else arguments.hardening


def refuse_without_effect(arguments: argparse.Namespace) -> None:
    """Refuse options that the form does not use, a --fast that changes nothing, and two runs of one folder."""
    form, a = FormName(arguments.form), arguments
    penalised = " or ".join(name.value for name in PENALISED)
    routed = " or ".join(name.value for name in ROUTED)
    for option, value, used, by in (
        ("--kn", a.kn, form in PENALISED, f"--form {penalised}"),
        ("--kt", a.kt, form in PENALISED, f"--form {penalised}"),
        ("--increments", a.increments, a.accuracy is None, "no --accuracy beside it"),
        ("--solver", a.solver, form in ROUTED, f"--form {routed}"),
        ("--sigma-Y", a.sigma_Y, a.hardening is None, "no --hardening beside it"),
        ("--fast", a.fast or None, None in (a.elements, a.increments), "--elements or --increments left to it"),
    ):
        if value is not None and not used:
            raise SceneError(f"{option} has no effect on --form {form.value} as asked: it needs {by}")
    require(len(set(a.mu)) == len(a.mu), "--mu", a.mu, "different, a folder each")
    welds = [mu for mu in a.mu if math.isinf(mu)]
    require(
        not (welds and (form in PENALISED or form is FormName.DELASSUS)),
        "--mu",
        "inf",
        f"finite: {form.value} does not weld",
    )
    require(not (welds and a.fclib), "--mu", "inf", "finite with --fclib: a welded point is no Coulomb problem")
