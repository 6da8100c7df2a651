"""A file written by a journal: whenever the process is killed, or the disk is full, it is that of a commit."""

import os
import random
import shutil
import zlib

import pytest

from bipot.hdf5 import journal
from bipot.hdf5.journal import creating, reading, recover, writing
from bipot.hdf5.pages import COUNT, MAGIC, PAGE, PLACE, SUM, ForeignJournal, journal_of, pages_in


class Killed(BaseException):
    """Ends the process, as far as the file can tell."""


class Disk:
    """What the system was told to do, stopped after so many steps of it; a write may be cut in its middle."""

    def __init__(self, monkeypatch, left, failure):
        self.left, self.failure, self.done = left, failure, 0
        for name in ("write", "replace", "ftruncate", "open"):
            monkeypatch.setattr(journal.os, name, self.stepping(getattr(os, name), name))
        monkeypatch.setattr(journal.Path, "unlink", self.stepping(journal.Path.unlink, "unlink"))

    def stepping(self, real, name):
        def step(*arguments, **named):
            self.done += 1
            if self.done <= self.left:
                return real(*arguments, **named)
            if self.done == self.left + 1 and name == "write":
                descriptor, data = arguments
                real(descriptor, data[: len(data) // 2])
            # What ends the process ends its clean-up too.
            raise self.failure

        return step


def content(path):
    with reading(path) as file:
        return file.read()


def written(path, seed, commits):
    """Contents after each commit of random writes here and there, and what was done to the disk meanwhile."""
    rng, contents = random.Random(seed), []
    file = creating(path)
    for _ in range(commits):
        for _ in range(rng.randrange(1, 6)):
            file.seek(rng.randrange(0, 5 * PAGE))
            file.write(rng.randbytes(rng.choice([1, 7, 200, PAGE, 2 * PAGE + 3])))
        file.seek(0)
        whole = file.read()
        try:
            file.commit()
        except (Killed, OSError):
            # Nothing is written by that; a process that is killed closes nothing, but the system does.
            file.close()
            raise
        contents.append(whole)
        yield contents
    file.close()


@pytest.mark.parametrize("seed", range(3))
def test_what_is_written_is_read_back_after_every_commit(tmp_path, seed):
    path = tmp_path / "file"
    for contents in written(path, seed, 8):
        found = content(path)
        assert found[: len(contents[-1])] == contents[-1]
        assert not any(found[len(contents[-1]) :])
        assert not journal_of(path).exists()


@pytest.mark.parametrize("failure", [Killed(), OSError(28, "No space left on device")], ids=["killed", "full"])
@pytest.mark.parametrize("recovered", [False, True], ids=["read", "recovered"])
def test_stopped_at_any_step_the_file_is_that_of_the_last_commit_or_the_next(tmp_path, failure, recovered):
    commits, stopped = 4, 0
    for left in range(1000):
        folder = tmp_path / str(left)
        folder.mkdir()
        path, before = folder / "file", []
        with pytest.MonkeyPatch.context() as patched:
            Disk(patched, left, failure)
            try:
                for contents in written(path, 5, commits):
                    before = list(contents)
            except (Killed, OSError):
                stopped += 1
        if len(before) == commits:
            break
        if recovered and path.exists():
            recover(path)
            assert not journal_of(path).exists()
        whole = next_content(tmp_path, len(before))
        if not before and not path.exists():
            continue
        found = content(path)
        # What is behind its end nothing refers to.
        assert any(found[: len(one)] == one for one in [*before[-1:], whole])
    assert stopped == left > 20


def next_content(tmp_path, number):
    """What commit ``number`` makes of the file, undisturbed."""
    folder = tmp_path / f"whole{number}"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    *_, contents = written(folder / "file", 5, number + 1)
    return contents[-1]


def full(*_, **__):
    raise OSError(28, "No space left on device")


def test_a_full_disk_loses_nothing_that_was_committed_and_ends_all_writing(tmp_path):
    path = tmp_path / "file"
    file = creating(path)
    file.write(b"first")
    file.commit()
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(journal.os, "write", full)
        file.write(b"x" * 10 * PAGE)
        with pytest.raises(OSError, match="No space"):
            file.commit()
    assert file.failed
    # There is room again, but what HDF5 believes to be on disk is not.
    file.write(b"later")
    with pytest.raises(OSError, match="nothing more is written"):
        file.commit()
    file.close()
    assert content(path)[:5] == b"first"
    assert os.path.getsize(path) == PAGE


def test_a_journal_that_is_damaged_is_none(tmp_path):
    path = tmp_path / "file"
    for _ in written(path, 1, 2):
        pass
    old = content(path)
    for text in (b"", b"something", MAGIC, MAGIC + b"\xff" * 20, MAGIC + bytes(12)):
        journal_of(path).write_bytes(text)
        assert not pages_in(path)
        assert content(path) == old
        assert recover(path)
        assert not recover(path)


def test_a_new_file_is_not_what_the_journal_of_the_one_it_replaces_makes_of_it(tmp_path):
    path = tmp_path / "file"
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(journal.Path, "unlink", full)
        with pytest.raises(OSError, match="No space"):
            for _ in written(path, 5, 3):
                pass
    assert pages_in(path)
    file = creating(path)
    file.write(b"new")
    file.commit()
    file.close()
    assert content(path)[:3] == b"new"
    assert not any(content(path)[3:])


def interrupted(path, seed, commits):
    """A file whose last commit got into its journal and no further; the contents before it, and after."""
    before = [list(contents) for contents in written(path, seed, commits - 1)][-1][-1]
    with pytest.MonkeyPatch.context() as patched, writing(path) as file:
        patched.setattr(journal, "_put", lambda *_: None)
        patched.setattr(journal.Path, "unlink", full)
        file.write(random.Random(seed + 1).randbytes(3 * PAGE))
        with pytest.raises(OSError, match="No space"):
            file.commit()
    return before, content(path)


@pytest.mark.parametrize("copied", ["another file", "an older state"])
def test_a_journal_of_another_file_or_state_is_refused(copied, tmp_path):
    path, other = tmp_path / "file", tmp_path / "other"
    interrupted(path, 1, 3)
    whole = path.read_bytes()
    if copied == "another file":
        for _ in written(other, 7, 2):
            pass
        other.write_bytes(other.read_bytes().ljust(len(whole), b"\0"))
    else:
        other.write_bytes(bytes(reversed(whole)))
    shutil.copy(other, path)
    for touch in (reading, writing, recover):
        with pytest.raises(ForeignJournal, match="journal belongs to another file or another state of it; delete it"):
            touch(path)
    assert path.read_bytes() == other.read_bytes()
    # What replaces the file needs neither.
    with creating(path) as new:
        new.write(b"new")
        new.commit()
    assert content(path)[:3] == b"new"
    assert not journal_of(path).exists()


@pytest.mark.parametrize("applied", range(4))
def test_a_journal_that_is_partly_applied_is_its_own_files(applied, tmp_path):
    path = tmp_path / "file"
    before, after = interrupted(path, 1, 3)
    assert before != after
    pages = sorted(pages_in(path).items())
    assert len(pages) == 3
    with path.open("r+b") as file:
        for number, (place, page) in enumerate(pages):
            file.seek(place * PAGE)
            file.write(page if number < applied else page[: PAGE // 2] if number == applied else b"")
    assert content(path) == after
    assert recover(path)
    assert content(path) == after


@pytest.mark.parametrize("place", [-1, 2**20, 2**62])
def test_a_journal_of_pages_that_are_not_there_is_refused(place, tmp_path):
    path = tmp_path / "file"
    for _ in written(path, 1, 1):
        pass
    body = MAGIC + COUNT.pack(1) + PLACE.pack(place, 0) + bytes(PAGE)
    journal_of(path).write_bytes(body + SUM.pack(zlib.crc32(body)))
    with pytest.raises(ForeignJournal):
        recover(path)


def test_a_journal_longer_than_its_file_could_need_is_refused_unread(tmp_path):
    path = tmp_path / "file"
    for _ in written(path, 1, 1):
        pass
    with journal_of(path).open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(ForeignJournal):
        content(path)


def test_a_file_that_was_replaced_meanwhile_is_not_written(tmp_path):
    path = tmp_path / "file"
    file = creating(path)
    file.write(b"mine")
    file.commit()
    path.unlink()
    path.write_bytes(b"another's")
    file.write(b"more")
    with pytest.raises(OSError, match="replaced"):
        file.commit()
    file.close()
    assert path.read_bytes() == b"another's"


def test_a_folder_that_vanished_is_said(tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir()
    file = creating(folder / "file")
    file.write(b"mine")
    file.commit()
    shutil.rmtree(folder)
    file.write(b"more")
    with pytest.raises(FileNotFoundError):
        file.commit()
    file.close()


def test_an_existing_file_is_written_on(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"0123456789" * 1000)
    file = writing(path)
    file.seek(5)
    file.write(b"abc")
    file.commit()
    file.close()
    assert path.read_bytes()[:10000] == b"01234abc89" + b"0123456789" * 999
