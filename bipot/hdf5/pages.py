"""The pages of a file, and the journal beside it with the pages to be replaced, their old checksums and new
contents."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path

PAGE = 4096
"""Bytes of a page."""

MAGIC = b"bipot journal 2\n"
COUNT, PLACE, SUM = struct.Struct("<q"), struct.Struct("<qI"), struct.Struct("<I")
"""Of the pages; a page's number and the checksum of what it was; the checksum of all."""

Pages = Mapping[int, bytes | bytearray]
"""Content by number of the page."""


def journal_of(path: Path) -> Path:
    """The path of a file's journal."""
    return path.with_name(f"{path.name}.journal")


def journal_text(descriptor: int, pages: Pages) -> bytes:
    """The journal of ``pages`` that are to replace those of an open file."""
    before = {number: zlib.crc32(read_page(descriptor, number)) for number in pages}
    records = (PLACE.pack(number, before[number]) + page for number, page in pages.items())
    body = MAGIC + COUNT.pack(len(pages)) + b"".join(records)
    return body + SUM.pack(zlib.crc32(body))


class ForeignJournal(OSError):
    """A journal beside a file for which it was not written, as when one of them was copied from elsewhere."""


def pages_in(path: Path) -> dict[int, bytes]:
    """The pages in the complete journal of a file; none if there is no journal, or an unfinished one.

    Raises:
        ForeignJournal: the file's pages are neither what they were for the journal nor what it makes of them.
        OSError: the file or its journal cannot be read.
    """
    journal, head, record = journal_of(path), len(MAGIC) + COUNT.size, PLACE.size + PAGE
    # A journal only replaces pages that are there.
    most = head + -(-os.path.getsize(path) // PAGE) * record + SUM.size
    try:
        with journal.open("rb") as file:
            text = file.read(most + 1)
    except FileNotFoundError:
        return {}
    if len(text) > most:
        raise _foreign(path)
    if len(text) < head + SUM.size or not text.startswith(MAGIC):
        return {}
    (count,) = COUNT.unpack_from(text, len(MAGIC))
    body, end = text[: -SUM.size], text[-SUM.size :]
    if count < 0 or len(body) != head + count * record or SUM.pack(zlib.crc32(body)) != end:
        return {}
    starts = range(head, len(body), record)
    pages = {at: (*PLACE.unpack_from(body, at), body[at + PLACE.size : at + record]) for at in starts}
    _require_own(path, list(pages.values()))
    return {number: page for number, _, page in pages.values()}


def _require_own(path: Path, pages: Sequence[tuple[int, int, bytes]]) -> None:
    """Refuse pages of another file: by number, checksum of what was there, and what is to be."""
    known, strange = -(-os.path.getsize(path) // PAGE), 0
    with path.open("rb") as file:
        for number, before, after in pages:
            if not 0 <= number < known:
                raise _foreign(path)
            there = read_page(file.fileno(), number)
            strange += there != after and zlib.crc32(there) != before
    # One may be half written.
    if strange > 1:
        raise _foreign(path)


def _foreign(path: Path) -> ForeignJournal:
    name = journal_of(path).name
    return ForeignJournal(f"{name} belongs to another file or another state of it; delete it to read the file as it is")


def read_page(descriptor: int, number: int) -> bytes:
    """A page of an open file, zeros behind its end."""
    os.lseek(descriptor, number * PAGE, os.SEEK_SET)
    return os.read(descriptor, PAGE).ljust(PAGE, b"\0")
