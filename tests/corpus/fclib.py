"""Valid FCLIB problems by hand, in every storage there is, and what only such files can have wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import h5py
import numpy as np
from scipy import sparse

from tests.corpus.case import Case, damaged

STORAGES = ("triplets", "columns", "rows")


def stored(matrix: sparse.csr_array, storage: str) -> dict[str, np.ndarray | int]:
    """Nz, p, i and x of a matrix; triplets twice half the value, which add to the whole."""
    if storage == "triplets":
        found = sparse.coo_array(matrix)
        row, column = (np.tile(each, 2) for each in found.coords)
        return {"nz": row.size, "p": column, "i": row, "x": np.tile(found.data / 2, 2)}
    compressed = sparse.csc_array(matrix) if storage == "columns" else sparse.csr_array(matrix)
    nz = -1 if storage == "columns" else -2
    return {"nz": nz, "p": compressed.indptr, "i": compressed.indices, "x": compressed.data}


def write(
    path: Path,
    dim: int,
    matrices: Mapping[str, np.ndarray],
    vectors: Mapping[str, np.ndarray],
    storage: str = "rows",
    solution: Mapping[str, np.ndarray] | None = None,
    **options: object,
) -> Path:
    """A problem as others write it; ``options`` are those of the datasets' storage."""
    form = "fclib_local" if "W" in matrices else "fclib_global"
    with h5py.File(path, "w") as file:
        file[f"{form}/spacedim"] = np.array([dim], np.int32)
        for name, matrix in matrices.items():
            group, found = file.create_group(f"{form}/{name}"), stored(sparse.csr_array(matrix), storage)
            numbers = {"m": matrix.shape[0], "n": matrix.shape[1], "nz": found["nz"], "nzmax": len(found["x"])}
            for key, number in numbers.items():
                group[key] = np.array([number], np.int32)
            group.create_dataset("p", data=np.asarray(found["p"], np.int32), **options)
            group.create_dataset("i", data=np.asarray(found["i"], np.int32), **options)
            group.create_dataset("x", data=found["x"], **options)
        for name, vector in vectors.items():
            file[f"{form}/vectors/{name}"] = np.asarray(vector, float)
        for name, vector in (solution or {}).items():
            file[f"solution/{name}"] = np.asarray(vector, float)
    return path


def local(path: Path, storage: str = "rows", **options: object) -> Path:
    """Two contacts in space, full matrix."""
    rng = np.random.default_rng(5)
    W = rng.normal(size=(6, 6)) + 6 * np.eye(6)
    vectors = {"q": rng.normal(size=6), "mu": [0.3, 0.5]}
    return write(path, 3, {"W": W}, vectors, storage, {"u": np.ones(6), "r": np.ones(6)}, **options)


def both(path: Path, storage: str = "rows", **options: object) -> Path:
    """Two contacts in the plane of a body with five unknowns: the global form."""
    rng = np.random.default_rng(6)
    M, H = np.diag(1 + np.arange(5.0)), rng.normal(size=(5, 4))
    vectors = {"f": rng.normal(size=5), "w": rng.normal(size=4), "mu": [0.3, 0.5]}
    solution = {"u": np.ones(4), "r": np.ones(4), "v": np.ones(5)}
    return write(path, 2, {"M": M, "H": H}, vectors, storage, solution, **options)


Damage = tuple[str, Callable[[Path], None]]
"""What a message must name, which is not what was damaged where it no longer fits to another field, and the damage."""


def put(name: str, value: object, dtype: object = None, named: str = "") -> Damage:
    """Another dataset under that name."""

    def damage(path: Path) -> None:
        with h5py.File(path, "a") as file:
            del file[name]
            file.create_dataset(name, data=value, dtype=dtype)

    return named or name, damage


def change(name: str, place: int, value: float, named: str = "") -> Damage:
    """One number of a dataset."""

    def damage(path: Path) -> None:
        with h5py.File(path, "a") as file:
            file[name][place] = value

    return named or name, damage


def added(name: str) -> Damage:
    def damage(path: Path) -> None:
        with h5py.File(path, "a") as file:
            file.create_group(name)

    return name.rsplit("/", 1)[-1], damage


def without(name: str) -> Damage:
    def damage(path: Path) -> None:
        with h5py.File(path, "a") as file:
            del file[name]

    return name.rsplit("/", 1)[-1], damage


LARGE = 2**31 - 1
ROOT, W, V = "fclib_local", "fclib_local/W", "fclib_local/vectors"
LOCAL = {
    "no form": without(ROOT),
    "no matrix": without(W),
    "no vectors": without(V),
    "no nzmax": without(f"{W}/nzmax"),
    **{f"spacedim {d}": change(f"{ROOT}/spacedim", 0, d) for d in (-3, 0, 1, 4, LARGE)},
    "spacedim of two numbers": put(f"{ROOT}/spacedim", [3, 3]),
    "spacedim a float": put(f"{ROOT}/spacedim", [3.0]),
    "spacedim a text": put(f"{ROOT}/spacedim", "3"),
    **{f"{name} {value}": change(f"{W}/{name}", 0, value) for name in "mn" for value in (-1, 0, 5, 7, LARGE)},
    "m beyond 64 bits": put(f"{W}/m", [2**64 - 1], np.uint64),
    "m of no numbers": put(f"{W}/m", np.zeros(0, np.int32)),
    "nz of no storage": change(f"{W}/nz", 0, -3),
    "nz of more than there are": change(f"{W}/nz", 0, 37, f"{W}/nzmax"),
    "nz beyond everything": change(f"{W}/nz", 0, LARGE, f"{W}/nzmax"),
    "nz of triplets": change(f"{W}/nz", 0, 36, f"{W}/p"),
    "nzmax too small": change(f"{W}/nzmax", 0, 35),
    "nzmax negative": change(f"{W}/nzmax", 0, -1),
    "p too short": put(f"{W}/p", np.arange(0, 36, 6)),
    "p too long": put(f"{W}/p", np.arange(0, 48, 6)),
    "p from one": change(f"{W}/p", 0, 1),
    "p negative": change(f"{W}/p", 1, -6),
    "p falls": change(f"{W}/p", 3, 6),
    "p ends beyond the entries": change(f"{W}/p", 6, 42, f"{W}/nzmax"),
    "p ends beyond everything": change(f"{W}/p", 6, LARGE, f"{W}/nzmax"),
    "p of floats": put(f"{W}/p", np.arange(0.0, 42.0, 6.0)),
    "i negative": change(f"{W}/i", 7, -1),
    "i beyond the columns": change(f"{W}/i", 7, 6),
    "i beyond everything": change(f"{W}/i", 7, LARGE),
    "i too short": put(f"{W}/i", np.zeros(35, np.int32)),
    "x too short": put(f"{W}/x", np.zeros(35)),
    "x too large for squares": change(f"{W}/x", 7, 1e200, "W"),
    "q too short": put(f"{V}/q", np.zeros(3), named=f"{V}/mu"),
    "q too long": put(f"{V}/q", np.zeros(9), named=f"{V}/mu"),
    "q of no whole contacts": put(f"{V}/q", np.zeros(7)),
    "q of no contacts": put(f"{V}/q", np.zeros(0)),
    "mu negative": change(f"{V}/mu", 1, -0.1),
    "mu for one of two": put(f"{V}/mu", [0.3]),
    "mu for every row": put(f"{V}/mu", np.full(6, 0.3)),
}
"""What must be named, and the damage, of :func:`local`."""

G, U = "fclib_global", "fclib_global/vectors"
GLOBAL = {
    "bilateral": added(f"{G}/G"),
    "M of other size": change(f"{G}/M/m", 0, 4),
    "H of other size": change(f"{G}/H/n", 0, 5),
    "f too short": put(f"{U}/f", np.zeros(4), named=f"{G}/M/m"),
    "w of no whole contacts": put(f"{U}/w", np.zeros(5)),
    "w too long": put(f"{U}/w", np.zeros(6), named=f"{U}/mu"),
    "M without rows": change(f"{G}/M/m", 0, 0),
}
"""The same of :func:`both`."""

TRIPLETS = {
    "i beyond the rows": change(f"{W}/i", 3, 6),
    "p beyond the columns": change(f"{W}/p", 3, 6),
    "p negative": change(f"{W}/p", 3, -1),
    "nz of more than there are": change(f"{W}/nz", 0, 73, f"{W}/nzmax"),
    "m beyond everything": change(f"{W}/m", 0, LARGE),
}
"""The same of :func:`local` in triplets."""

SOLUTION = {
    "r too short": put("solution/r", np.ones(5)),
    "r too long": put("solution/r", np.ones(7)),
    "u NaN": change("solution/u", 0, np.nan),
    "u text": put("solution/u", "none"),
    "solution a number": put("solution", 3.0),
}
"""The same of :func:`local`, for who reads its solution."""


def cases(valid: Path, folder: Path, table: Mapping[str, Damage]) -> Iterator[Case]:
    """Copies of ``valid``, one for each damage of the table."""
    for kind, (field, damage) in table.items():
        yield from damaged(valid, folder, {kind: damage}, field)
