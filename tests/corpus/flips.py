"""Flips bits and overwrites bytes of valid files, by a fixed seed, and tells what a reader made of them.

    python -m tests.corpus.flips --count 5000        FCLIB files of every storage
    python -m tests.corpus.flips --file run.vtkhdf --reader module:function

Only bytes near some that are not zero are changed: the rest of a small HDF5 file is empty. A changed number makes
another problem, so that many files are accepted; what counts is that none ends the process, hangs, raises what is no
error of this package, or takes much.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import h5py

from tests.corpus import fclib
from tests.corpus.child import Answer, Child, Outcome

NEAR = 4
"""Bytes around one that is not zero that are worth a change."""


@dataclass(frozen=True)
class Flips:
    """What came of one file's damage."""

    name: str
    counts: Counter[Outcome]
    bad: tuple[Answer, ...]
    seconds: float
    megabytes: float

    def __str__(self) -> str:
        counts = ", ".join(f"{self.counts[outcome]} {outcome}" for outcome in Outcome)
        return f"{self.name}: {counts}; at most {self.seconds:.2f} s and {self.megabytes:.0f} MB a file"


def worth(content: bytes) -> list[int]:
    """Places that are worth a change."""
    return [k for k in range(len(content) - 8) if any(content[max(k - NEAR, 0) : k + NEAR + 1])]


def changed(content: bytes, live: list[int], random: Random) -> bytes:
    """One to four bits flipped, or up to eight bytes overwritten by ones, zeros, noise or other bytes of the file."""
    found = bytearray(content)
    if random.random() < 0.5:
        for _ in range(random.choice((1, 1, 2, 4))):
            found[random.choice(live)] ^= 1 << random.randrange(8)
        return bytes(found)
    place, size, other = random.choice(live), random.choice((1, 2, 4, 8)), random.choice(live)
    new = random.choice((b"\xff" * size, bytes(size), random.randbytes(size), content[other : other + size]))
    found[place : place + size] = new
    return bytes(found)


def flipped(valid: Path, reader: str, count: int, seed: int = 0) -> Flips:
    """What the reader makes of ``count`` damaged copies of a valid file."""
    content, random = valid.read_bytes(), Random(seed)
    live = worth(content)
    with TemporaryDirectory() as folder, Child(reader, valid) as child:
        path = Path(folder) / valid.name

        def answers() -> Iterator[Answer]:
            for _ in range(count):
                path.write_bytes(changed(content, live, random))
                yield child.ask(path)

        found = list(answers())
    bad = tuple(a for a in found if a.outcome not in (Outcome.ACCEPTED, Outcome.REFUSED))
    counts = Counter(answer.outcome for answer in found)
    return Flips(valid.name, counts, bad, max(a.seconds for a in found), max(a.megabytes for a in found))


def fclib_files(folder: Path) -> Iterator[Path]:
    """Valid problems: data in one piece, in chunks, in packed chunks, and these with the metadata of HDF5 1.8."""
    packed = {"chunks": (6,), "maxshape": (None,), "compression": "gzip", "shuffle": True, "fletcher32": True}
    yield fclib.both(folder / "contiguous.hdf5", "triplets")
    yield fclib.local(folder / "chunked.hdf5", chunks=(3,), maxshape=(None,))
    yield fclib.local(folder / "packed.hdf5", **packed)
    with (
        h5py.File(folder / "packed.hdf5") as old,
        h5py.File(folder / "v108.hdf5", "w", libver=("v108", "v108")) as new,
    ):
        for name in old:
            old.copy(name, new)
    yield folder / "v108.hdf5"


def main(argv: list[str] | None = None) -> int:
    """Print what came of each file; exit code 1 where one did harm."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000, help="damaged copies of each file")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--file", type=Path, help="a valid file (default: FCLIB files made here)")
    parser.add_argument("--reader", default="bipot.coulomb:read_fclib", help="MODULE:FUNCTION of a path")
    asked = parser.parse_args(argv)
    harm = False
    with TemporaryDirectory() as folder:
        for valid in [asked.file] if asked.file else fclib_files(Path(folder)):
            found = flipped(valid, asked.reader, asked.count, asked.seed)
            harms = (f"  {answer.outcome}: {answer.message:.200}" for answer in found.bad[:10])
            sys.stdout.write("\n".join([str(found), *harms]) + "\n")
            harm = harm or bool(found.bad)
    return int(harm)


if __name__ == "__main__":
    raise SystemExit(main())
