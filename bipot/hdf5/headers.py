"""Headers of objects, checked in the bytes of a file before HDF5 opens the objects.

Trees, heaps and arrays of chunks introduced by HDF5 1.8 and 1.10 can be crafted so that HDF5 2.0 divides by zero, reads
out of bounds, or never returns as soon as such an object is opened. Writers use these forms for groups with many links,
for many attributes, or on request (``libver="latest"``). Files without them withstand damage, as
``python -m tests.corpus.flips`` measures. An object is plain if its header holds all links and attributes, or refers to
the oldest trees only.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

from bipot.hdf5.source import Source

SIGNATURE, HEADER = b"\x89HDF\r\n\x1a\n", b"OHDR"
"""First bytes of a file, and of the newer kind of header."""

LAYOUT, LINKS, ATTRIBUTES, CONTINUATION = 8, 2, 21, 16
"""Types of messages of a header that refer to further pieces."""

PLAIN = {0, 1, 3, 4, 5, 6, 7, 10, 11, 12, 13, 14, 17, 18, 22, LAYOUT, LINKS, ATTRIBUTES, CONTINUATION}
"""Types of messages that a plain object may have."""

SHARED = 2
"""Flag of a message that is kept in another header."""

NEWEST_LAYOUT = 3
"""Version of a layout whose chunks are found by the oldest kind of tree."""

IN_ONE_PIECE = (b"\0", b"\1")
"""Classes of a layout, of any version, that needs no tree."""

NOWHERE = b"\xff" * 8
"""Address of a missing heap."""

LARGEST_HEADER = 2**20
"""Bytes of all pieces of one header: HDF5 writes far shorter ones."""

WORDS = "of a form that files have which are not written with libver='latest'"


def require_plain_file(source: Source) -> None:
    """Refuse a file that does not begin as one of HDF5, or whose root is not plain."""
    start = source.bytes_at(0, 16)
    version = start[8]
    source.require(start[:8] == SIGNATURE, "its first bytes", start[:8], f"{SIGNATURE!r}, those of an HDF5 file")
    source.require(version <= 3, "version of its superblock", version, "at most 3")
    sizes = start[13:15] if version < 2 else start[9:11]
    source.require(sizes == b"\x08\x08", "sizes of its addresses and lengths", list(sizes), "[8, 8]")
    if version >= 2:
        extension = source.bytes_at(20, 8)
        source.require(extension == NOWHERE, "extension of its superblock", "there", f"none, {WORDS}")
    place = {0: 64, 1: 68}.get(version, 36)
    require_plain(source, "/", int.from_bytes(source.bytes_at(place, 8), "little"))


def require_plain(source: Source, field: str, address: int) -> None:
    """Refuse an object whose header, at that address, refers to forms that are not plain."""
    for kind, flags, body in _messages(source, field, address):
        plain = kind in PLAIN and not flags & SHARED
        source.require(plain, f"{field}: type of a message of its header", kind, WORDS)
        if kind == LAYOUT:
            version, held = body[0] if body else 0, body[1:2] in IN_ONE_PIECE
            allowed = f"at most {NEWEST_LAYOUT}, {WORDS}"
            source.require(version <= NEWEST_LAYOUT or held, f"{field}: version of its layout", version, allowed)
        if kind in (LINKS, ATTRIBUTES):
            counted = body[1] & 1 if len(body) > 1 else 0
            heap = body[2 + counted * (8 if kind == LINKS else 2) :][:8]
            source.require(heap == NOWHERE, f"{field}: heap of its links or attributes", "there", f"none, {WORDS}")


def _messages(source: Source, field: str, address: int) -> Iterator[tuple[int, int, bytes]]:
    """Type, flags and body of every message of a header."""
    start = source.bytes_at(address, 16)
    newer = start.startswith(HEADER)
    source.require(newer or start[0] == 1, f"{field}: version of its header", start[0], "1 or 2")
    if newer:
        options = start[5]
        wide, first = 1 << (options & 3), 6 + (16 if options & 0x20 else 0) + (4 if options & 0x10 else 0)
        size = int.from_bytes(source.bytes_at(address + first, wide), "little")
        pieces, form = [(address + first + wide, size)], "<BHB2x" if options & 4 else "<BHB"
    else:
        pieces, form = [(address + 16, int.from_bytes(start[8:12], "little"))], "<HHB3x"
    total = 0
    for place, length in pieces:
        total += length
        source.require(total <= LARGEST_HEADER, f"{field}: bytes of its header", total, f"at most {LARGEST_HEADER}")
        for kind, flags, body in _split(source, field, source.bytes_at(place, length), form):
            if kind == CONTINUATION:
                there, more = struct.unpack("<QQ", body[:16].ljust(16, b"\0"))
                # A further piece of the newer kind has its signature before and a checksum behind.
                pieces.append((there + 4, max(more - 8, 0)) if newer else (there, more))
            yield kind, flags, body


def _split(source: Source, field: str, piece: bytes, form: str) -> Iterator[tuple[int, int, bytes]]:
    """The messages of one piece of a header."""
    place, start = 0, struct.calcsize(form)
    while place + start <= len(piece):
        kind, length, flags = struct.unpack_from(form, piece, place)
        place += start + length
        source.require(place <= len(piece), f"{field}: end of a message of its header", place, f"at most {len(piece)}")
        yield kind, flags, piece[place - length : place]
