"""Several materials in one body, each in elements of its own, as one :class:`~bipot.laws.material.Materials`.

Arrays of points are (e, …) or (e q, …), element by element, unlike those of a single material, which may have any
shape; moduli are (e, 1).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Generic, TypeVar

import numpy as np

from bipot.laws.material import Material, Materials
from bipot.laws.von_mises import Elasticity, Returned, TangentKind
from bipot.typing import Floats, Ints

Law = TypeVar("Law")


@dataclass(frozen=True)
class Everywhere(Generic[Law]):
    """The ``laws`` of the parts of a body; that of each of its elements has the ``number`` (e,)."""

    laws: tuple[Law, ...]
    number: Ints

    def parts(self, points: int) -> Iterator[tuple[Law, Ints]]:
        """Each law with its own of the rows of an array with so many ``points``."""
        if points not in self._rows:
            number = np.repeat(self.number, points // len(self.number))
            self._rows[points] = [np.flatnonzero(number == k) for k in range(len(self.laws))]
        return zip(self.laws, self._rows[points], strict=True)

    @cached_property
    def _rows(self) -> dict[int, list[Ints]]:
        return {}

    def of(self, value: Callable[..., Floats], *arrays: Floats) -> Floats:
        """``value(law, …)`` of each law's own rows of the ``arrays``, of the shape of the first of these."""
        out = np.empty_like(arrays[0])
        for law, mine in self.parts(len(out)):
            out[mine] = value(law, *(array[mine] for array in arrays))
        return out


@dataclass(frozen=True)
class ElasticityByRegion:
    """The elasticity of each element: moduli E, K and G (e, 1), and (6) point by point."""

    everywhere: Everywhere[Elasticity]
    young: Floats
    bulk: Floats
    shear: Floats

    @staticmethod
    def of(everywhere: Everywhere[Elasticity]) -> ElasticityByRegion:
        """Of the elasticity of each part."""
        moduli = np.array([(law.young, law.bulk, law.shear) for law in everywhere.laws])
        return ElasticityByRegion(everywhere, *moduli[everywhere.number].T[..., None])

    def stiffness(self, size: int) -> Floats:
        """C^e of (6), shape (e, 1, s, s)."""
        return np.stack([law.stiffness(size) for law in self.everywhere.laws])[self.everywhere.number, None]

    def stress(self, strain: Floats) -> Floats:
        """The stress of an elastic strain."""
        return self.everywhere.of(lambda law, e: law.stress(e), strain)

    def strain(self, stress: Floats) -> Floats:
        """The elastic strain of a stress."""
        return self.everywhere.of(lambda law, s: law.strain(s), stress)


@dataclass(frozen=True)
class MaterialByRegion:
    """The materials of the parts of a body, none of which drifts."""

    everywhere: Everywhere[Material]
    elasticity: ElasticityByRegion
    drifts: ClassVar[bool] = False

    def yield_stress(self, peeq: Floats) -> Floats:
        """σ_Y."""
        return self.everywhere.of(lambda law, p: law.yield_stress(p), peeq)

    def slope(self, peeq: Floats) -> Floats:
        """H."""
        return self.everywhere.of(lambda law, p: law.slope(p), peeq)

    def dissipation(self, plastic_strain: Floats, peeq: Floats) -> Floats:
        """σ_Y |e_p|_eq."""
        return self.everywhere.of(lambda law, p, e_p: law.dissipation(e_p, p), peeq, plastic_strain)

    def update(self, rotated: Floats, strain: Floats, peeq: Floats) -> Returned:
        """Each material's own."""
        trial, stress, e_p, direction = (np.empty_like(rotated) for _ in range(4))
        out = Returned(trial, stress, e_p, np.empty_like(peeq), direction, np.empty(peeq.shape, dtype=bool))
        for law, mine in self.everywhere.parts(len(peeq)):
            for name, found in vars(law.update(rotated[mine], strain[mine], peeq[mine])).items():
                getattr(out, name)[mine] = found
        return out

    def tangent(self, rotated: Floats, returned: Returned, peeq: Floats, kind: TangentKind) -> Floats:
        """C (…, s, s)."""
        out = np.empty((*rotated.shape, rotated.shape[-1]))
        for law, mine in self.everywhere.parts(len(peeq)):
            own = Returned(**{name: found[mine] for name, found in vars(returned).items()})
            out[mine] = law.tangent(rotated[mine], own, peeq[mine], kind)
        return out


def materials_of(parts: Sequence[tuple[Material, Ints]]) -> Materials:
    """The material of a body of several ``parts``, each with its elements."""
    materials = tuple(material for material, _ in parts)
    if len(parts) == 1:
        return materials[0]
    number = np.empty(sum(len(mine) for _, mine in parts), dtype=np.intp)
    for k, (_, mine) in enumerate(parts):
        number[mine] = k
    elastic = Everywhere(tuple(material.elasticity for material in materials), number)
    return MaterialByRegion(Everywhere(materials, number), ElasticityByRegion.of(elastic))
