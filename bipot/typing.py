"""Array aliases, products of arrays with one type each, and what frozen objects are that hold arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, TypeGuard, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bipot.errors import SceneError, require, require_number

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]

Pair = tuple[float, float]
Vector = tuple[float, ...]

Scalar = TypeVar("Scalar", bound=np.generic)
Key = TypeVar("Key")
Value = TypeVar("Value", covariant=True)

einsum: Callable[..., Any] = np.einsum
""":func:`numpy.einsum` itself, with one type in the place of twelve: a type checker tries them all at every call."""


def times(matrices: Floats, vectors: Floats) -> Floats:
    """Matrices (…, i, j) on vectors (…, j)."""
    return (matrices @ vectors[..., None])[..., 0]


def vdot(a: Floats, b: Floats) -> float:
    """The sum of a b over all entries of two arrays of one size.

    >>> vdot(np.eye(2), np.array([[1.0, 2.0], [3.0, 4.0]]))
    5.0
    """
    return float(np.vdot(a, b))


def listed(value: object) -> TypeGuard[Sequence[Any]]:
    """Whether ``value`` is a tuple, a list or an array with items in it: one without an axis has none."""
    return isinstance(value, tuple | list) or (isinstance(value, np.ndarray) and value.ndim > 0)


def max_abs(values: NDArray[Any] | float) -> float:
    """The largest magnitude of all entries of an array; 0 where there is none.

    >>> max_abs(np.array([[1.0, -3.0]])), max_abs(np.empty(0))
    (3.0, 0.0)
    """
    return float(np.abs(values).max(initial=0.0))


def as_array(values: object, field: str) -> NDArray[Any]:
    """``values`` as an array; raises SceneError where they are no rows of one length, or one is masked.

    >>> as_array([[1, 2], [3, 4]], "table").shape
    (2, 2)
    """
    require(not np.ma.is_masked(values), field, "with masked values", "numbers throughout")
    try:
        return np.asarray(values)
    except (ValueError, TypeError) as error:
        raise SceneError(f"{field}: must be an array of numbers, rows of one length") from error


def as_numbers(values: object, field: str) -> Floats:
    """``values`` as an array of floats; raises SceneError where they are not numbers, or one is masked."""
    array = as_array(values, field)
    # A name of the type takes longer to make than the check.
    if array.dtype.kind not in "fiu":
        require(False, field, f"of type {array.dtype}", "numbers")
    return array.astype(np.float64)


def make_floats(made: object, *fields: str, of: str = "", **within: str) -> None:
    """Make floats of the numbers in these ``fields`` of a frozen object, called ``of`` + field in messages.

    Fields given by name are ``within`` intervals, such as "in (0, 1]", "> 0" or "finite and >= 0". A NumPy scalar would
    impose its own precision on everything computed with it.

    Raises:
        SceneError: one is no number that a float can hold, or not in its interval.
    """
    for field in (*fields, *within):
        value = getattr(made, field)
        require_number(value, of + field)
        object.__setattr__(made, field, float(value))
    for field, allowed in within.items():
        require_within(getattr(made, field), of + field, allowed)


def require_within(value: Any, field: str, allowed: str) -> None:
    """Raise SceneError unless ``value`` is a number in an interval that is ``allowed``, as in :func:`make_floats`."""
    require_number(value, field)
    require(_is(float(value), allowed), field, value, allowed)


def _is(value: float, allowed: str) -> bool:
    """Whether a number is in an interval.

    >>> [_is(1.0, allowed) for allowed in ("in (0, 1]", "in [0, 1)", ">= 1", "> 1", "finite and > 0")]
    [True, False, True, False, True]
    """
    if allowed.startswith("in "):
        low, high = map(float, allowed[4:-1].split(", "))
        return low < value < high or (value == low and allowed[3] == "[") or (value == high and allowed[-1] == "]")
    *finite, sign, least = allowed.split()
    above = value >= float(least) if sign == ">=" else value > float(least)
    return above and not (finite and value == float("inf"))


def read_only(values: ArrayLike, kind: type[Scalar]) -> NDArray[Scalar]:
    """A copy of ``values`` as numbers of ``kind`` that refuses to be written to.

    >>> read_only([1, 2], np.float64).flags.writeable
    False
    """
    array = np.array(values, dtype=kind)
    array.flags.writeable = False
    return array


def make_arrays(made: object, of: str, **shapes: str) -> None:
    """Make read-only arrays of floats of fields of a frozen object, called ``of`` + field in messages.

    The ``shapes``, such as "(a, d)", tell their numbers of axes.

    Raises:
        SceneError: one is not of numbers, has a masked one, or another number of axes.
    """
    for field, shape in shapes.items():
        array = as_numbers(getattr(made, field), of + field)
        axes = len(shape.removesuffix(",)").split(","))
        require(array.ndim == axes, of + field, f"of shape {array.shape}", f"of shape {shape}")
        array.flags.writeable = False
        object.__setattr__(made, field, array)


def _sealed(values: Iterable[object]) -> None:
    """Make arrays read-only, those of sparse matrices and of dictionaries included."""
    for value in values:
        if isinstance(value, dict):
            _sealed(value.values())
        array = value if isinstance(value, np.ndarray) else getattr(value, "data", None)
        if isinstance(array, np.ndarray):
            array.flags.writeable = False


def _told(value: object) -> object:
    """What ``value`` is compared by: the numbers of an array; zeros of either sign and all NaN are the same."""
    if isinstance(value, np.ndarray):
        return value.shape, (value + 0).tobytes()
    return "NaN" if isinstance(value, float) and value != value else value


class Sealed:
    """An object whose arrays are read-only, and still so in copies: pickles and deep copies forget it of arrays."""

    def __setstate__(self, state: dict[str, object]) -> None:
        _sealed(state.values())
        vars(self).update(state)


@dataclass(frozen=True, eq=False)
class EqualByNumbers(Sealed):
    """A frozen dataclass with read-only arrays, equal to another one of its class where all fields are.

    Its subclasses are dataclasses with ``eq=False``: those made by default compare arrays, which have no truth value.
    """

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, EqualByNumbers) or type(self) is not type(other):
            return False
        return self is other or self._numbers == other._numbers

    def __hash__(self) -> int:
        return hash(self._numbers)

    @property
    def _numbers(self) -> tuple[object, ...]:
        return tuple(_told(getattr(self, field.name)) for field in fields(self))


class FrozenMap(Sealed, Mapping[Key, Value]):
    """An immutable mapping; unlike ``MappingProxyType`` it can be pickled and copied.

    >>> FrozenMap({"top": 1})
    FrozenMap({'top': 1})
    """

    def __init__(self, items: Mapping[Key, Value]) -> None:
        self._items = dict(items)

    def __getitem__(self, key: Key) -> Value:
        return self._items[key]

    def __iter__(self) -> Iterator[Key]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    def __or__(self, other: Mapping[Key, Value]) -> FrozenMap[Key, Value]:
        """Both, as of dictionaries: where a key is in both, the other's value.

        >>> FrozenMap({"top": 1}) | {"below": 2}
        FrozenMap({'top': 1, 'below': 2})
        """
        return FrozenMap({**self, **other})

    def __repr__(self) -> str:
        return f"FrozenMap({self._items!r})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Mapping) and _by_key(self) == _by_key(other)

    def __hash__(self) -> int:
        return hash(frozenset(_by_key(self).items()))


def _by_key(items: Mapping[Any, object]) -> dict[Any, object]:
    """What the values of a mapping are compared by."""
    return {key: _told(value) for key, value in items.items()}
