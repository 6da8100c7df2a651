"""A spring on tools that forces drive, where nothing else in a program resists their translation.

A program that is solved by its stiffness alone (`delassus`) takes one for every such tool.

It has no tension where the tool is at the iterate, so the passes take its pull away: the next one finds the tool where
this one leaves it (a proximal point), and at the end of the increment there is none.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from bipot.forms.posed import Posed
from bipot.iterate import Iterate
from bipot.programs.conic import TangentProgram
from bipot.typing import Bools

SOFT = 1e-5
"""Of a tool's elastic support, the stiffness of the spring."""


def softly_held(program: TangentProgram, iterate: Iterate, state: Posed, tools: Bools) -> TangentProgram:
    """The program with a spring on the chosen ``tools`` (m,) of those that forces drive."""
    if not tools.any():
        return program
    space, units = iterate.increment.system.body.space, state.units
    spring = SOFT * tools * iterate.increment.system.rigidity.tools * (units.length / units.force)
    K, f = sp.csc_matrix(program.K, copy=True), program.f.copy()
    # Each has one entry in its column: a sum of matrices would lose the zeros of the run's pattern.
    K.data[K.indptr[len(space.free) : -1]] += spring
    f[len(space.free) :] += spring * iterate.translated / units.length
    return replace(program, K=K, f=f)


def unresisted(program: TangentProgram, iterate: Iterate) -> Bools:
    """Tools (m,) that forces drive along contacts without any friction yet, and against none."""
    terms, count = program.contact, iterate.translated.size
    against = terms.rows.G_n.indices
    dragged, _ = terms.tangent_rows(terms.sliding | terms.stuck | terms.coned)
    first = iterate.x.size - count
    return ~np.isin(first + np.arange(count), np.concatenate([against, dragged.indices]))
