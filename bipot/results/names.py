"""The fields of a run by name: their places, meanings, units and components."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from bipot.errors import require, require_type
from bipot.fem.reduction import NAMES, Geometry


class Place(StrEnum):
    """Where a field has its values."""

    NODES = "nodes"
    ELEMENTS = "elements"
    POINTS = "integration points"


GROUPS: Mapping[Place, str] = {Place.NODES: "PointData", Place.ELEMENTS: "CellData"}
"""VTK's names of the groups of fields."""


class Quantity(StrEnum):
    """What a field measures."""

    LENGTH = "length"
    RATE = "length per unit of pseudo-time"
    FORCE = "force"
    STRESS = "stress"
    RATIO = "ratio"
    STATUS = "status"
    NUMBER = "number"


MEASURED = (*map(str, (Quantity.LENGTH, Quantity.FORCE, Quantity.STRESS)), "energy")
"""Quantities with units of their own; columns of energy name theirs too, but readers of a run find it here."""


class Rank(StrEnum):
    """The kind of a field by its components."""

    SCALAR = "scalar"
    VECTOR = "vector"
    TENSOR = "symmetric tensor"


@dataclass(frozen=True)
class Field:
    """A field: ``finite`` if it is so at all its places, ``kind`` its type (NumPy's letter)."""

    quantity: Quantity
    rank: Rank
    meaning: str
    finite: bool = True
    kind: str = "f"

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of a value at a node or an element, as in VTK."""
        return {Rank.SCALAR: (), Rank.VECTOR: (3,), Rank.TENSOR: (6,)}[self.rank]


STRESSES: Mapping[str, Field] = {
    "stress": Field(Quantity.STRESS, Rank.TENSOR, "Cauchy stress"),
    "plastic_strain": Field(Quantity.RATIO, Rank.TENSOR, "plastic strain, turned with the body"),
    "mises": Field(Quantity.STRESS, Rank.SCALAR, "equivalent stress of von Mises"),
    "pressure": Field(Quantity.STRESS, Rank.SCALAR, "mean pressure, minus a third of the trace of the stress"),
    "peeq": Field(Quantity.RATIO, Rank.SCALAR, "equivalent plastic strain"),
}
"""Fields of the material: computed at integration points, averaged over elements and at nodes."""

FIELDS: Mapping[Place, Mapping[str, Field]] = {
    Place.NODES: {
        "displacement": Field(Quantity.LENGTH, Rank.VECTOR, "displacement since rest"),
        "velocity": Field(Quantity.RATE, Rank.VECTOR, "displacement of the increment over its length"),
        "contact_force": Field(Quantity.FORCE, Rank.VECTOR, "force of the tools on a node; on a meridian on its ring"),
        "contact_pressure": Field(Quantity.STRESS, Rank.SCALAR, "normal traction of a candidate, recovered", False),
        "contact_shear": Field(
            Quantity.STRESS,
            Rank.SCALAR,
            "tangential traction of a candidate, recovered: along (n_y, -n_x), in space a length",
            False,
        ),
        "gap": Field(Quantity.LENGTH, Rank.SCALAR, "distance of a candidate from its tool", False),
        "status": Field(Quantity.STATUS, Rank.SCALAR, "what a candidate does in the increment", kind="i"),
        **STRESSES,
    },
    Place.ELEMENTS: STRESSES,
    Place.POINTS: STRESSES,
}

REGION = "region"

FIXED: Mapping[Place, Mapping[str, Field]] = {
    Place.NODES: {},
    Place.ELEMENTS: {
        REGION: Field(Quantity.NUMBER, Rank.SCALAR, "number of its region, of several the first; -1 in none", kind="i")
    },
    Place.POINTS: {},
}
"""Fields that are the same in all steps, of runs on a mesh with regions."""

AXES: Mapping[Geometry, tuple[str, ...]] = {
    Geometry.AXISYMMETRIC: ("r", "z"),
    Geometry.PLANE_STRAIN: ("x", "y"),
    Geometry.SOLID: ("x", "y", "z"),
}
"""Names of the components of a vector."""


def component_names(field: Field, geometry: Geometry) -> tuple[str, ...]:
    """Names of a field's components in the order of the file, in which further ones are zero.

    >>> component_names(STRESSES["stress"], Geometry.AXISYMMETRIC)
    ('rr', 'zz', 'tt', 'rz')
    """
    return {Rank.SCALAR: (), Rank.VECTOR: AXES[geometry], Rank.TENSOR: NAMES[geometry]}[field.rank]


def meant(place: Place, name: str, geometry: Geometry) -> tuple[str, Field, str]:
    """A field by its name, itself, and the component that a ``name`` means, "" for all: "stress_zz" is one of "stress".

    Raises:
        SceneError: a name of no field and no component; the message lists the names.

    >>> meant(Place.NODES, "stress_rz", Geometry.AXISYMMETRIC)[::2]
    ('stress', 'rz')
    """
    require_type(name, str, "field")
    known = {**FIELDS[place], **FIXED[place]}
    if name in known:
        return name, known[name], ""
    single = {
        f"{base}_{part}": (base, field, part)
        for base, field in known.items()
        for part in component_names(field, geometry)
    }
    require(name in single, "field", name, f"one of {[*known, *single]}")
    return single[name]


def unit_of(quantity: Quantity, units: Mapping[str, str], geometry: Geometry) -> str:
    """The unit of a quantity from a run's ``units``, in words if these lack it; forces of plane strain are per length.

    >>> unit_of(Quantity.STRESS, {"force": "N", "length": "mm"}, Geometry.SOLID)
    'N/mm^2'
    >>> unit_of(Quantity.FORCE, {"force": "N", "length": "mm"}, Geometry.PLANE_STRAIN)
    'N per mm of thickness'
    """
    if quantity in (Quantity.RATIO, Quantity.STATUS, Quantity.NUMBER):
        return "1"
    length, force = (str(units.get(q, f"unit of {q}")) for q in (Quantity.LENGTH, Quantity.FORCE))
    derived = {
        Quantity.LENGTH: length,
        Quantity.RATE: f"{length} per unit of pseudo-time",
        Quantity.FORCE: force,
        Quantity.STRESS: f"{force}/{length}^2" if {"length", "force"} <= units.keys() else "unit of stress",
    }
    if quantity is Quantity.FORCE and geometry is Geometry.PLANE_STRAIN:
        return f"{force} per {length} of thickness"
    return str(units.get(quantity, derived[quantity]))


def require_units(units: Mapping[str, str]) -> None:
    """Refuse units of what has none of its own; a quantity by another name would be written without its unit.

    Raises:
        SceneError: a quantity that is not in :data:`MEASURED`, a unit that is no text.
    """
    for quantity, unit in units.items():
        require(quantity in MEASURED, "units", quantity, f"a quantity, one of {list(MEASURED)}")
        require_type(unit, str, f"units[{quantity!r}]")


def described(
    geometry: Geometry, units: Mapping[str, str], regions: bool = False
) -> dict[str, dict[str, dict[str, object]]]:
    """All fields in plain words: meaning, unit and components, by place and name; of ``regions`` if there are any."""
    return {
        place.value: {
            name: {
                "meaning": field.meaning,
                "unit": unit_of(field.quantity, units, geometry),
                "components": list(component_names(field, geometry)),
            }
            for name, field in {**fields, **(FIXED[place] if regions else {})}.items()
        }
        for place, fields in FIELDS.items()
    }
