"""A scene prepared for a march: the body and its contact candidates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bipot.certificate import EPS
from bipot.contact.candidates import Candidates
from bipot.contact.chosen import candidates
from bipot.contact.closeness import LEAST_MOTION
from bipot.fem.assembly import element_force, rigid_motions
from bipot.programs.data import Units
from bipot.response import Body, Response, body_space
from bipot.scene.loads import Loading
from bipot.scene.scene import Scene
from bipot.state import State, rest
from bipot.tensors import norm
from bipot.tools.deformable import DeformableTool
from bipot.typing import Floats, max_abs, read_only


@dataclass(frozen=True)
class System:
    """A scene prepared for a march: body and candidates, which face what they do where nodes are ``there`` (a, d).

    Where nodes are decides only at deformable tools; None is at rest.
    """

    body: Body
    candidates: Candidates
    there: Floats | None = None

    def facing(self, nodes: Floats) -> System:
        """The system whose candidates at deformable tools face what they do where nodes are at ``nodes`` (a, d)."""
        if not self.candidates.deformable or (self.there is not None and np.array_equal(nodes, self.there)):
            return self
        # Frames in space follow those at rest.
        found = candidates(self.body.scene, self.body.space, nodes)
        like = self.candidates.like or self.candidates
        return replace(self, candidates=replace(found, like=like), there=read_only(nodes, np.float64))

    @cached_property
    def loading(self) -> Loading:
        """The scene's loads on the body's unknowns."""
        return Loading(self.body.space, self.body.scene.loads)

    def load(self, nodal: Floats, tau: float) -> Floats:
        """The load on the unknowns (n,): ``nodal`` loads (a, d) and the driving forces of tools at ``tau``."""
        return self.body.space.gather(np.append(nodal, self.body.scene.drives.at(tau)))

    def balanced(self, state: State) -> Floats:
        """The configuration (a, d) in which an accepted state is in equilibrium."""
        return self.body.scene.balanced(state.nodes - state.du, state.du)

    def carried(self, state: State) -> Floats:
        """The load on the unknowns (n,) that a state carries: its internal forces less those of its contacts.

        Raises:
            InvertedElement: an element is inverted in the configuration in which the state is in equilibrium.
        """
        body = self.body
        placed = body.space.gradients(self.balanced(state))
        contacts = self.facing(state.nodes).candidates
        pushed = contacts.load(state.forces, state.nodes, body.scene.placed(state.tau, state.translation))
        return body.space.vector(element_force(placed, state.stress)) - pushed

    def reactions(self, element_forces: Floats, load: Floats, contacts: Floats) -> Floats:
        """Forces (a, d) of the supports: they balance element forces (e, dk), loads (a, d) and ``contacts`` (w, d)."""
        out = self.body.space.nodal(element_forces) - load - self.candidates.met.nodal(contacts)
        out = self.body.space.axes.components(out)
        out.ravel()[self.body.space.free] = 0.0
        return self.body.space.axes.field(out)

    @cached_property
    def rigid(self) -> Floats:
        """Rigid motions (n, m) of parts at rest that the supports allow, tools at rest; none if they hold each."""
        return self._rigid_motions(self.body.scene.mesh.nodes)

    def rigid_at(self, nodes: Floats) -> Floats:
        """The same in the configuration ``nodes`` (a, d)."""
        return self._rigid_motions(nodes) if self.rigid.size else self.rigid

    def strainless_at(self, nodes: Floats) -> Floats:
        """Motions (n, m) that strain nothing: :meth:`rigid_at`, then those of each coordinate of driven tools alone."""
        rigid, driven = self.rigid_at(nodes), self.body.space.translations
        # Coordinates of driven tools are the last unknowns.
        return np.hstack([rigid, np.eye(len(rigid), driven, k=driven - len(rigid))])

    def _rigid_motions(self, nodes: Floats) -> Floats:
        space = self.body.space
        found = rigid_motions(nodes, space.free, self.body.scene.geometry, space.axes, self.body.scene.mesh.part)
        return np.vstack([found, np.zeros((space.translations, found.shape[1]))]) if space.translations else found

    @cached_property
    def shares(self) -> bool:
        """Whether contact forces may be undetermined: a node has more of them than free unknowns, or two contacts.

        Only then does :mod:`bipot.checks.determinacy` test ranks. A weighted point counts at its own node alone, though
        its mean has others. Means of deformable tools are independent where nodes of the candidates are free.
        """
        contacts, (count, d) = self.candidates, self.body.scene.mesh.nodes.shape
        free = (self.body.space.position.reshape(count, d) >= 0).sum(axis=1)[contacts.node]
        forces = 1 + (d - 1) * contacts.tangent_free
        return not contacts.alone.all() or bool((forces > free).any()) or self._twice_faced

    @property
    def _twice_faced(self) -> bool:
        """Whether a node is on sides of two deformable tools, which then may forbid one motion twice."""
        tools, mesh = self.body.scene.tools, self.body.scene.mesh
        sides = [mesh.boundary_nodes(*t.surface, *t.candidates) for t in tools if isinstance(t, DeformableTool)]
        return len(sides) > 1 and bool((np.unique_counts(np.concatenate(sides)).counts > 1).any())

    @cached_property
    def stiffness(self) -> Floats:
        """Elastic stiffness (c,) of contacts with weights D_ca, 1/sum_a D_ca^2/K_a with that of nodes at rest."""
        return np.asarray(1 / (self.candidates.means.weights.power(2) @ (1 / self.body.rigidity.nodal)))

    @cached_property
    def tool_stiffness(self) -> Floats:
        """Its sums (m,) over the contacts of each coordinate of driven tools."""
        return self.candidates.driven_sums(self.stiffness)

    def units(self, start: State, prescribed: float, new_load: Floats) -> Units:
        """Units: the expected displacement, the stress to be reached (up to the yield stress), the volume of a cube.

        In plane strain the volume is that of a square of unit thickness. The expected displacement is the largest of
        what is ``prescribed`` (travel of tools and supports), or of the last motion if nothing is, and of the elastic
        displacement that ``new_load`` on the unknowns (n,) causes at its own nodes and those of its tools. If all are
        zero, it is the displacement that would release the stress, or at least a small part of the body's size. It is
        never less than a small part of what would release the stress: the motions of a body that rests fall to
        round-off from increment to increment, and in units of that a program has forces but no stiffness left.
        """
        scene, space = self.body.scene, self.body.space
        young, size = max_abs(scene.materials.elasticity.young), scene.mesh.size
        stress = float(norm(start.stress).max())
        moved, loaded = float(norm(start.du).max()), 0.0
        if scene.loads or scene.drives:
            nodes = norm(space.spread(new_load)) / self.body.rigidity.nodal
            tools = np.abs(space.beside(new_load)) / self.tool_stiffness
            loaded = float(max(nodes.max(), tools.max(initial=0.0)))
        released = size * stress / young
        length = max(prescribed or moved, loaded) or max(released, LEAST_MOTION * size)
        length = max(length, LEAST_MOTION * released)
        reached = max(young * length / size, stress)
        stress = min(float(self.body.yield_stress.min()), reached)
        return Units(length, size, stress, size**scene.geometry.reduction.extents)

    def force_blur(self, response: Response, moved: float, faint: float) -> float:
        """Largest round-off of a nodal internal force (module docstring of bipot.checks.examined).

        :meth:`round_off` if that is at most ``faint``. ``moved`` is the sum of the increment's lengths.
        """
        estimate = self.round_off(response.rotated, moved)
        if estimate <= faint:
            return estimate
        elastic, kin = self.body.scene.materials.elasticity, response.kinematics
        gradient = np.abs(kin.shape).sum(axis=2)
        stress = norm(response.rotated) + (elastic.bulk + 2 * elastic.shear) * moved * gradient.sum(axis=2)
        forces = ((stress * kin.volume)[:, None, :] @ gradient)[:, 0]
        return EPS * float(np.bincount(self.body.scene.mesh.elements.ravel(), forces.ravel()).max())

    def round_off(self, stress: Floats, moved: float) -> float:
        """An estimate from above of the round-off of a nodal force, by the mesh at rest and therefore tenfold.

        The largest ``stress`` (..., s) counts, and its change in an increment with lengths that sum to ``moved``.
        """
        elastic, rest = self.body.scene.materials.elasticity, self.body.rigidity
        largest = max_abs(stress) + max_abs(elastic.bulk + 2 * elastic.shear) * moved * rest.gradient
        return 10 * EPS * rest.lever * largest

    @cached_property
    def gaps_at_rest(self) -> Floats:
        """Gaps (c,) of all candidates at rest."""
        scene = self.body.scene
        return self.candidates.distance(scene.mesh.nodes, scene.at_rest)

    def rest(self) -> State:
        """The state at rest."""
        return rest(self.body.scene, self.gaps_at_rest)


def system_of(scene: Scene) -> System:
    """Body and contact candidates of a scene."""
    space = body_space(scene)
    return System(Body(scene, space), candidates(scene, space))
