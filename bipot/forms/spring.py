"""A spring on tools driven by forces or moments, where nothing else in a program resists them.

A program that is solved through its stiffness alone (`delassus`) needs one for every such tool. `newton` has its own.

The spring has no tension at the iterate, so each pass is a proximal-point step: its pull vanishes as the passes
converge, and the solution of the increment is free of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from bipot.forms.posed import Posed
from bipot.iterate import Iterate
from bipot.programs.conic import TangentProgram
from bipot.programs.dissipation import DissipationProgram
from bipot.programs.terms import ContactTerms
from bipot.typing import Bools, Floats

SOFT = 1e-5
"""The stiffness of the spring over that of the tool's elastic support."""


def softly_held(program: TangentProgram, iterate: Iterate, state: Posed, tools: Bools) -> TangentProgram:
    """The program with a spring on the chosen ``tools`` (m,), coordinates that are driven."""
    if not tools.any():
        return program
    space, (spring, tension) = iterate.increment.system.body.space, _springs(iterate, state, tools)
    K, f = sp.csc_matrix(program.K, copy=True), program.f.copy()
    # A sum of matrices would lose the zeros of the run's pattern.
    K.data[space.diagonal] += spring
    f[len(space.free) :] += tension
    return replace(program, K=K, f=f)


def softly_placed(program: DissipationProgram, iterate: Iterate, state: Posed) -> DissipationProgram:
    """The program with a spring on those tools that nothing resists."""
    tools = unresisted(program.contact, iterate)
    if not tools.any():
        return program
    spring, tension = _springs(iterate, state, tools)
    free = np.zeros(iterate.x.size - tools.size)
    force = program.force + np.append(free, tension)
    return replace(program, force=force, spring=np.append(free, spring))


def _springs(iterate: Iterate, state: Posed, tools: Bools) -> tuple[Floats, Floats]:
    """Stiffness (m,) of the springs on the chosen ``tools`` (m,), and what they pull by from zero; dimensionless."""
    units = state.units
    spring = SOFT * tools * iterate.increment.system.rigidity.tools * (units.length / units.force)
    return spring, spring * iterate.translated / units.length


def unresisted(terms: ContactTerms, iterate: Iterate) -> Bools:
    """Coordinates (m,) of tools that are driven along contacts without any friction yet, and against none."""
    count = iterate.translated.size
    dragged, _ = terms.tangent_rows(terms.sliding | terms.stuck | terms.coned)
    # Where tools are curved rows keep the entries that are zero.
    resisted = [G.indices[G.data != 0] for G in (terms.rows.G_n, dragged)]
    first = iterate.x.size - count
    return ~np.isin(first + np.arange(count), np.concatenate(resisted))
