"""Limit loads without a march: how much of its load a body carries in a given shape, and its collapse mechanism.

The program, and why its answer is a proof, are in :mod:`bipot.programs.limit`. Hardening material is taken as fully
hardened. Friction follows the dilatant law, whose limit load is not below that of a body with Coulomb friction.
Contacts are those that touch in the given shape. When a march has failed (:func:`collapse`), open candidates of a tool
that touches nothing yet count as contacts, too, because the body may land there. Other open candidates do not hold the
body, but its proof may not close them, because they would then hold it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy.sparse as sp
from scipy.linalg import null_space

from bipot.checks.determinacy import ROUND_OFF, cleaned
from bipot.errors import InfeasibleProgram, ProgramError, require, require_type
from bipot.fem.kinematics import Kinematics
from bipot.fem.projection import Projection
from bipot.iterate import Increment
from bipot.programs.data import ContactRows, Units
from bipot.programs.limit import UNMOVED, LimitProgram, Mechanism, sliding, unit_rows
from bipot.response import Body
from bipot.scene.loads import Loading
from bipot.scene.scene import Scene
from bipot.system import System, system_of
from bipot.tensors import identity
from bipot.typing import Bools, EqualByNumbers, Floats, einsum, max_abs, read_only, require_within

SATURATED = 1e9
"""A plastic strain at which a saturating law has saturated; a law that still hardens has no limit load."""

HARDENS = 1e-6
"""Relative growth of the yield stress from a tenth of SATURATED up to it, above which a law has not saturated."""

CANCELLED = 1e-12
"""Sum of the loads over the largest of them, below which they cancel each other up to round-off."""


Find = Callable[[Increment, Floats, ContactRows], Mechanism]
"""Finds a mechanism of an increment's body under a load (n,), with these contacts; raises ProgramError."""


@dataclass(frozen=True, eq=False)
class LimitLoad(EqualByNumbers):
    """The largest ``multiple`` of the load that is carried, and the collapse ``motion`` (a, d), largest part one.

    It is zero where a driven tool slips on a body at rest.
    """

    multiple: float
    motion: Floats


def limit_load(scene: Scene, tau: float = 1.0) -> LimitLoad:
    """The limit load of a body at rest, as a multiple of its loads and of forces on its tools at pseudo-time ``tau``.

    It is the limit load of the mesh, by a kinematic program (:mod:`bipot.programs.limit`). With friction it is that of
    the dilatant law, which is not below what the body carries.

    Raises:
        SceneError: a wrong type, a ``tau`` outside [0, 1], a load that is zero, a driven tool that touches nothing,
            capped friction (tool.shear), a material that does not flow or hardens without limit.
        InfeasibleProgram: any multiple is carried, by locking elements, supports or tools.
        ProgramError: no mechanism was found to the accuracy that its inequalities require.
    """
    require_type(scene, Scene, "scene")
    require_within(tau, "tau", "in [0, 1]")
    for k, tool in enumerate(scene.tools):
        require(not tool.capped, f"scene.tools[{k}].shear", tool.shear, "inf: the program knows Coulomb's cone alone")
    system = system_of(scene)
    increment = Increment(system, system.rest(), float(tau))
    load = _load(increment)
    allowed = "above round-off, to be multiplied: loads must not cancel, and a tool's force is driven_by=Force(...)"
    require(max_abs(load) > _round_off(increment), f"largest nodal load at tau = {tau}", max_abs(load), allowed)
    for name in scene.parts:
        material = scene.regions.get(name, scene.material)
        near, last = material.yield_stress(np.array([SATURATED / 10, SATURATED]))
        field = f"scene.regions[{name!r}]" if name else "scene.material"
        saturates = np.isfinite(last) and last <= (1 + HARDENS) * near
        require(saturates, field, material, "one that flows at a last yield stress")
    touching = _touching(increment)
    for k, drive in zip(scene.drives.tool.tolist(), scene.drives.by, strict=True):
        touches = bool(touching[system.candidates.tool == k].any())
        require(touches, f"scene.tools[{k}]", drive, "on a tool that touches the body at rest")
    rows = increment.unmoved.rows.take(touching)
    # Plastic flow would give the limit load of what slides, zero, to few digits.
    found = _first_proof((_slid,), increment, load, rows) or _program(increment, load, rows).mechanism()
    if not found.admissible:
        short = f"changes volume by {found.volume:.2g} and closes contacts by {found.overtaken:.2g} of the load's gain"
        raise ProgramError(f"no mechanism found: the nearest {short}")
    if not found.share > _cancelled(scene):
        raise InfeasibleProgram(UNMOVED)
    motion, most = system.body.space.spread(found.v), max_abs(found.v)
    still = max_abs(motion) <= ROUND_OFF * most
    return LimitLoad(found.carried, read_only(np.zeros_like(motion) if still else motion / max_abs(motion), np.float64))


def collapse(increment: Increment) -> Mechanism | None:
    """The mechanism by which the body collapses under the load at the increment's end, in the shape at its start.

    It is a proof; its v is a length over the load's gain. None where none is found, or with capped friction.
    """
    load = _load(increment)
    if increment.system.candidates.capped or not max_abs(load) > _round_off(increment):
        return None
    tool, near, rows = increment.system.candidates.tool, _touching(increment), increment.unmoved.rows
    # The body may come to be held by tools that touch nothing yet. Any other open candidate may not close, however it
    # slips.
    holding = near | ~np.isin(tool, tool[near])
    rows = replace(rows, mu=np.where(holding, rows.mu, 0.0))
    return _first_proof((partial(_lifted, holding), _slid, _flown), increment, load, rows)


def _first_proof(finds: Iterable[Find], increment: Increment, load: Floats, rows: ContactRows) -> Mechanism | None:
    """The first mechanism found that holds, None if none does."""
    for find in finds:
        try:
            found = find(increment, load, rows)
        except ProgramError:
            continue
        if found.holds:
            return found
    return None


def _lifted(holding: Bools, increment: Increment, load: Floats, rows: ContactRows) -> Mechanism:
    """A mechanism without strain by which no contact slips, as where the body tips over an edge."""
    system = increment.system
    contacts, motions = system.candidates, system.strainless_at(increment.start.nodes)
    # Smooth contacts have no rows of slip; with friction they would.
    rough = replace(contacts, mu=np.where(contacts.mu == 0, 1.0, contacts.mu))
    slips = replace(increment, system=replace(system, candidates=rough)).unmoved.rows.take(holding).G_t @ motions
    still = null_space(cleaned(slips, motions), rcond=ROUND_OFF)
    return replace(sliding(load, rows, motions @ still), rubs=False)


def _slid(increment: Increment, load: Floats, rows: ContactRows) -> Mechanism:
    """A mechanism without strain, in which contacts may slip."""
    return sliding(load, rows, increment.system.strainless_at(increment.start.nodes))


def _flown(increment: Increment, load: Floats, rows: ContactRows) -> Mechanism:
    """A mechanism of plastic flow."""
    if not np.isfinite(increment.system.body.yield_stress).all():
        raise InfeasibleProgram("an elastic body does not flow")
    found = _program(increment, load, rows).mechanism()
    return replace(found, v=found.v / _units(increment.system).force)


def _load(increment: Increment) -> Floats:
    """The load on the unknowns (n,) at the increment's end, in the shape at its start."""
    return increment.system.load(increment.loads.ahead, increment.tau)


def _round_off(increment: Increment) -> float:
    """Nodal force that is round-off of loads, driving forces of tools included, which cancel or which supports bear."""
    scene, space, tau = increment.system.body.scene, increment.system.body.space, increment.tau
    each = [np.abs(Loading(space, (load,)).forces(scene.mesh.nodes, tau)).max() for load in scene.loads]
    return _cancelled(scene) * float(max((*each, *np.abs(scene.drives.at(tau))), default=0.0))


def _cancelled(scene: Scene) -> float:
    """Sum of loads over their size that is round-off: far from the origin edges are differences of large numbers."""
    return CANCELLED * (1 + float(np.abs(scene.mesh.nodes).max()) / scene.mesh.size)


def _units(system: System) -> Units:
    """The units of the program: independent of the load, with the body's least extent as length.

    With its length as unit, strains of a slender body would be large numbers, whose small sum solvers lose.
    """
    scene = system.body.scene
    x = scene.mesh.nodes - scene.mesh.nodes.mean(axis=0)
    # Of a block's principal axes the least extent is the root of twelve times the deviation along it.
    size = float(np.sqrt(12 / len(x)) * np.linalg.svd(x, compute_uv=False)[-1])
    return Units(size, size, float(system.body.yield_stress.min()), size**scene.geometry.reduction.extents)


def _touching(increment: Increment) -> Bools:
    """Candidates (c,) without a gap at the increment's start that are not past an open end of their tool."""
    start, system = increment.start, increment.system
    near = increment.tools.closed.copy()
    if system.candidates.curved:
        here = increment.tools.meeting(np.zeros_like(start.nodes), np.zeros_like(increment.tools.path))
        near &= ~system.candidates.faces.beyond(here)
    return near


def _independent(body: Body, kin: Kinematics, projection: Projection) -> sp.csr_matrix:
    """Rows (e k, n) of sum_q w phi_k tr B v, each over its length: all vanish where tr B v, in span phi, does."""
    changes = identity(kin.reduction.mandel) @ kin.B
    return unit_rows(body.space.operator(einsum("eq,eqk,eqj->ekj", kin.volume, projection.functions, changes)))


def _program(increment: Increment, load: Floats, rows: ContactRows) -> LimitProgram:
    """The kinematic program in :func:`_units`, for the load (n,) and contact rows."""
    body, state, units = increment.system.body, increment.start, _units(increment.system)
    response = body.respond(state, np.zeros(body.space.size))
    model = body.plastic_model(response)
    last = body.scene.materials.yield_stress(np.full(model.threshold.shape, SATURATED))
    # The scaled model of a form caps yield stresses that are out of its reach; a limit load may reach them.
    scaled = replace(model.scaled(units), threshold=last / units.stress)
    volumes = None if body.projection is None else _independent(body, response.kinematics, body.projection)
    return LimitProgram(scaled, load / units.force, rows, volumes)
