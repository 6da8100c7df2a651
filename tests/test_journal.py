"""A file written by a journal: whenever the process is killed, or the disk is full, it is that of a commit."""

import os
import random
import shutil

import pytest

from bipot.hdf5 import journal
from bipot.hdf5.journal import PAGE, creating, journal_of, pages_in, reading, recover, writing


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
            # A process that is killed closes nothing; the system does.
            os.close(file._descriptor) if file._descriptor is not None else None
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
    for text in (b"", b"something", journal.MAGIC, journal.MAGIC + b"\xff" * 20, journal.MAGIC + bytes(12)):
        journal_of(path).write_bytes(text)
        assert not pages_in(journal_of(path))
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
    assert pages_in(journal_of(path))
    file = creating(path)
    file.write(b"new")
    file.commit()
    file.close()
    assert content(path)[:3] == b"new"
    assert not any(content(path)[3:])


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
