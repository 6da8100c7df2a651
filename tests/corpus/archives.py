"""What an archive of NumPy arrays can have wrong: sizes, headers and packing that no reader may trust."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

Damage = Callable[[Path], None]

HUGE = 2**40


def members(path: Path) -> dict[str, bytes]:
    """Unpacked, by name."""
    with zipfile.ZipFile(path) as archive:
        return {info.filename: archive.read(info) for info in archive.infolist()}


def packed(path: Path, found: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> None:
    with zipfile.ZipFile(path, "w", method) as archive:
        for name, content in found.items():
            archive.writestr(name, content)


def npy(header: str, content: bytes = b"", version: tuple[int, int] = (1, 0)) -> bytes:
    """An array by the text of its header."""
    line = header.encode() + b"\n"
    return b"\x93NUMPY" + bytes(version) + struct.pack("<H", len(line)) + line + content


def array(dtype: str, shape: str, content: bytes = b"", order: bool = False) -> bytes:
    return npy(f"{{'descr': {dtype}, 'fortran_order': {order}, 'shape': {shape}, }}", content)


def saved(value: object) -> bytes:
    out = io.BytesIO()
    np.save(out, np.asarray(value), allow_pickle=True)
    return out.getvalue()


def member(name: str, content: bytes) -> Damage:
    """Another member of that name."""
    return lambda path: packed(path, {**members(path), f"{name}.npy": content})


def directory(name: str, offset: int, form: str, value: int) -> Damage:
    """Another number in the directory's record of a member, which starts with its signature."""

    def damage(path: Path) -> None:
        content = bytearray(path.read_bytes())
        record = content.rindex(f"{name}.npy".encode()) - 46
        assert content[record : record + 4] == b"PK\x01\x02"
        struct.pack_into(form, content, record + offset, value)
        path.write_bytes(content)

    return damage


def many(path: Path) -> None:
    """A hundred thousand members."""
    with zipfile.ZipFile(path, "a") as archive:
        for k in range(20_000):
            archive.writestr(f"{k}.npy", b"")


def lying(path: Path) -> None:
    """Header and directory agree, and the numbers are not there."""
    content = array("'<f8'", f"({2**28},)")
    member("q", content)(path)
    directory("q", 24, "<I", len(content) + 2**31)(path)


DAMAGES: dict[str, Damage] = {
    "a terabyte declared": member("q", array("'<f8'", f"({HUGE // 8},)")),
    "a terabyte in rows and columns": member("q", array("'<f8'", "(1048576, 1048576)")),
    "more numbers than any integer": member("q", array("'<f8'", f"({2**62}, 2)")),
    "a negative length": member("q", array("'<f8'", "(-1,)")),
    "a length that is none": member("q", array("'<f8'", "('8',)")),
    "less than declared": member("q", array("'<f8'", "(4,)", bytes(24))),
    "more than declared": member("q", array("'<f8'", "(4,)", bytes(40))),
    "objects": member("q", saved(np.array([{}], object))),
    "words of no letters": member("q", array("'<U0'", f"({HUGE},)")),
    "a word of a megabyte": member("terms", array("'<U262144'", "(1,)", bytes(2**20))),
    "fields": member("q", saved(np.zeros(4, [("x", "f8")]))),
    "complex": member("q", saved(np.zeros(4, complex))),
    "long doubles": member("q", saved(np.zeros(4, np.longdouble))),
    "dates": member("q", saved(np.zeros(4, "M8[s]"))),
    "bytes": member("q", saved(np.array([b"1.0"]))),
    "NaN": member("q", saved([1.0, np.nan])),
    "no header": member("q", b"\x93NUMPY"),
    "a header of code": member("q", npy("__import__('os').abort()")),
    "a header without end": member("q", npy("(" * 9000)),
    "a header of another version": member(
        "q", npy("{'descr': '<f8', 'fortran_order': False, 'shape': (0,)}", b"", (9, 0))
    ),
    "no member": lambda path: packed(path, {k: v for k, v in members(path).items() if k != "q.npy"}),
    "kind of a thousand words": member("kind", saved(["a"] * 1000)),
    "a hundred megabytes of zeros": member("q", array("'<f8'", f"({2**24},)", bytes(2**27))),
    "two gigabytes declared twice": lying,
    "packed by bzip2": lambda path: packed(path, members(path), zipfile.ZIP_BZIP2),
    "packed by lzma": lambda path: packed(path, members(path), zipfile.ZIP_LZMA),
    "packed by an unknown method": directory("q", 10, "<H", 99),
    "encrypted": directory("q", 8, "<H", 1),
    "a size that is another": directory("q", 24, "<I", 10**9),
    "a place beyond the file": directory("q", 42, "<I", 10**9),
    "another checksum": directory("q", 16, "<I", 1),
    "twenty thousand members": many,
    "a comment": lambda path: path.write_bytes(path.read_bytes()[:-2] + struct.pack("<H", 5) + b"PK\x05\x06."),
}
