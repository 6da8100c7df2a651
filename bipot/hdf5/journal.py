"""A file that is written whole or not at all: HDF5 writes to memory, and a journal puts its writes on disk.

HDF5 changes bytes in many places, so a process killed meanwhile leaves an unreadable file, and on a full disk the
library's own clean-up may crash. :class:`Journaled` is the file object that h5py is given instead: its writes cannot
fail, because they are kept as pages in memory. :meth:`Journaled.commit` then writes them to disk:

1. pages behind the committed ones are written at once, since nothing refers to them yet;
2. pages that replace committed ones go into a journal beside the file, which ends with a checksum;
3. these are written into the file, and the journal is deleted.

Killed before the journal is complete, the file is that of the last commit; afterwards it is the new one, once the
journal's pages are applied: by the next writer (:func:`recover`), or in memory by a reader (:func:`reading`). A journal
identifies the pages that it replaces, so it is applied to no other file and to no other state of it. This order is
safe if the process ends, but not if the machine loses power, which would require waiting for the disk.
"""

from __future__ import annotations

import io
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

from bipot.hdf5.pages import PAGE, ForeignJournal, Pages, journal_of, journal_text, pages_in, read_page


def recover(path: Path) -> bool:
    """Finish or discard an interrupted commit before the file is written again; returns whether there was one.

    Raises:
        ForeignJournal: it was one of another file.
        OSError: the file or its folder cannot be written.
    """
    journal = journal_of(path)
    if not journal.exists():
        return False
    pages = pages_in(path) if path.exists() else {}
    if pages:
        descriptor = os.open(path, os.O_WRONLY | _BINARY)
        try:
            _put(descriptor, pages)
        finally:
            os.close(descriptor)
    journal.unlink()
    return True


class Journaled(io.RawIOBase):
    """A binary file for h5py's file-object driver; see the module's text.

    Attributes:
        path: of the file, ``name`` the same as a text.
        failed: whether a commit failed, or writes are to be discarded: nothing more is put on disk.
    """

    def __init__(self, path: Path, descriptor: int | None, pages: Pages) -> None:
        self.path, self.name, self.failed = path, str(path), False
        self._descriptor = descriptor
        self._dirty = {number: bytearray(page) for number, page in pages.items()}
        self._committed = os.fstat(descriptor).st_size if descriptor is not None else 0
        self._size, self._position = self._committed, 0

    # What h5py calls.

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Set the position."""
        self._position = {io.SEEK_SET: 0, io.SEEK_CUR: self._position, io.SEEK_END: self._size}[whence] + offset
        return self._position

    def tell(self) -> int:
        """The position."""
        return self._position

    def truncate(self, size: int | None = None) -> int:
        """Set the length that HDF5 sees."""
        self._size = self._position if size is None else size
        return self._size

    def readinto(self, buffer: Any) -> int:
        """Read from memory where it is newer than the disk."""
        view = memoryview(buffer).cast("B")
        end, done = min(self._position + len(view), self._size), 0
        while self._position < end:
            number, within = divmod(self._position, PAGE)
            count = min(PAGE - within, end - self._position)
            view[done : done + count] = self._page(number)[within : within + count]
            self._position += count
            done += count
        return done

    def write(self, data: Any) -> int:
        """Keep it in memory."""
        view = memoryview(data).cast("B")
        done = 0
        while done < len(view):
            number, within = divmod(self._position, PAGE)
            count = min(PAGE - within, len(view) - done)
            page = self._dirty.get(number)
            if page is None:
                page = self._dirty[number] = bytearray(PAGE) if count == PAGE else bytearray(self._page(number))
            page[within : within + count] = view[done : done + count]
            self._position += count
            done += count
        self._size = max(self._size, self._position)
        return done

    # What a writer calls.

    def commit(self) -> None:
        """Write to disk everything since the last commit: all of it, or none.

        Raises:
            OSError: it cannot be written; the file on disk is whole, and nothing is written to it any more.
        """
        if self.failed:
            raise OSError("nothing more is written after a write that failed")
        try:
            if self._descriptor is None:
                self._descriptor = self._made()
            else:
                self._add(self._descriptor)
        except BaseException:
            self.failed = True
            raise
        finally:
            self._dirty = {}
        self._committed = os.fstat(self._descriptor).st_size

    def close(self) -> None:
        """Close the file as of the last commit."""
        if self._descriptor is not None and not self.closed:
            os.close(self._descriptor)
        super().close()

    def _made(self) -> int:
        """The file of the first commit, which replaces what was there under its name."""
        temporary = self.path.with_name(f"{self.path.name}.new")
        descriptor = os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_TRUNC | _BINARY, 0o666)
        try:
            _put(descriptor, self._dirty)
            # The journal of what is replaced would be taken for one of the new file.
            try:
                recover(self.path)
            except ForeignJournal:
                journal_of(self.path).unlink()
            os.replace(temporary, self.path)
        except OSError:
            os.close(descriptor)
            with suppress(OSError):
                temporary.unlink()
            raise
        return descriptor

    def _add(self, descriptor: int) -> None:
        there, held = os.stat(self.path), os.fstat(descriptor)
        if (there.st_dev, there.st_ino) != (held.st_dev, held.st_ino):
            raise OSError(f"{self.path.name} has been replaced while it was written")
        journal, known = journal_of(self.path), -(-self._committed // PAGE)
        old = {number: page for number, page in self._dirty.items() if number < known}
        try:
            _put(descriptor, {number: page for number, page in self._dirty.items() if number >= known})
            _write_whole(journal, journal_text(descriptor, old))
        except OSError:
            with suppress(OSError):
                journal.unlink(missing_ok=True)
            with suppress(OSError):
                os.ftruncate(descriptor, self._committed)
            raise
        # From here on the journal tells the new content, whether it gets into the file or not.
        _put(descriptor, old)
        journal.unlink()

    def _page(self, number: int) -> bytes | bytearray:
        """Content of a page, zeros behind the end."""
        held = self._dirty.get(number)
        if held is not None:
            return held
        return bytes(PAGE) if self._descriptor is None else read_page(self._descriptor, number)


def creating(path: Path) -> Journaled:
    """A new file, which appears under its name with its first commit and replaces what was there."""
    return Journaled(path, None, {})


def writing(path: Path) -> Journaled:
    """An existing file, recovered, to be written on; raises OSError."""
    recover(path)
    return Journaled(path, os.open(path, os.O_RDWR | _BINARY), {})


def reading(path: Path) -> Journaled:
    """An existing file to be read, a commit that was interrupted finished in memory; raises OSError."""
    return Journaled(path, os.open(path, os.O_RDONLY | _BINARY), pages_in(path))


_BINARY = getattr(os, "O_BINARY", 0)


def _put(descriptor: int, pages: Pages) -> None:
    """Write pages to their places."""
    for number in sorted(pages):
        os.lseek(descriptor, number * PAGE, os.SEEK_SET)
        _all(descriptor, pages[number])


def _all(descriptor: int, data: bytes | bytearray) -> None:
    """Write everything: the system may write a part, and report the reason only at the next attempt."""
    view = memoryview(data)
    while len(view):
        view = view[os.write(descriptor, view) :]


def _write_whole(path: Path, data: bytes) -> None:
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | _BINARY, 0o666)
    try:
        _all(descriptor, data)
    finally:
        os.close(descriptor)
