"""The main study's contact problems: those of its run, of all its increments or of none."""

import pytest

from bipot.coulomb import read_fclib
from bipot.results import open as open_results
from studies import upsetting

TINY = ["--elements", "1", "--reduction", "0.05", "--form", "newton", "--mu", "0.1"]


def study(out, *more):
    return upsetting.main([*TINY, "--out", str(out), *more])


def files(out):
    return sorted(path.name for path in (out / "mu0.1" / "fclib").glob("*"))


def expected(number):
    return [f"increment_{k:04d}.hdf5" for k in range(1, number + 1)]


def recorded(out):
    return len(open_results(out / "mu0.1"))


def broken(after):
    """A march that is interrupted after so many increments, the last of them not recorded."""
    real = upsetting.march

    def marching(*arguments):
        for accepted in real(*arguments):
            yield accepted
            if accepted.number == after:
                raise KeyboardInterrupt

    return marching


@pytest.fixture
def long(tmp_path):
    """The folder of a run with its problems, and a file of somebody else beside them."""
    assert study(tmp_path, "--increments", "14", "--fclib") == 0
    assert files(tmp_path) == expected(recorded(tmp_path))
    (tmp_path / "mu0.1" / "fclib" / "notes.txt").write_text("mine")
    return tmp_path


@pytest.mark.slow
def test_what_is_overwritten_is_gone_and_nothing_else(long):
    before = recorded(long)
    assert study(long, "--increments", "1", "--fclib", "--overwrite") == 0
    assert recorded(long) < before
    assert files(long) == [*expected(recorded(long)), "notes.txt"]
    assert study(long, "--increments", "1", "--overwrite") == 0
    assert files(long) == ["notes.txt"]


def test_a_folder_of_problems_goes_with_the_last_of_them(tmp_path):
    assert study(tmp_path, "--increments", "1", "--fclib") == 0
    assert study(tmp_path, "--increments", "1", "--overwrite") == 0
    assert not (tmp_path / "mu0.1" / "fclib").exists()


def test_a_run_without_problems_is_not_resumed_with_them(tmp_path, monkeypatch, capsys):
    asked = ["--increments", "2"]
    with monkeypatch.context() as patched:
        patched.setattr(upsetting, "march", broken(3))
        assert study(tmp_path, *asked) == 130
    assert study(tmp_path, *asked, "--resume", "--fclib") == 2
    assert "3 of its 3 increments were recorded without --fclib, first 1" in capsys.readouterr().err
    assert recorded(tmp_path) == 3
    assert study(tmp_path, *asked, "--resume") == 0
    assert study(tmp_path, *asked, "--resume", "--fclib") == 2


def test_an_interrupted_run_is_resumed_with_its_problems(tmp_path, monkeypatch):
    asked = ["--increments", "2", "--fclib"]
    with monkeypatch.context() as patched:
        patched.setattr(upsetting, "march", broken(3))
        assert study(tmp_path, *asked) == 130
    folder = tmp_path / "mu0.1" / "fclib"
    (folder / "increment_0004.hdf5").write_text("of an increment that was not recorded any more")
    assert study(tmp_path, *asked, "--resume") == 0
    assert files(tmp_path) == expected(recorded(tmp_path))
    assert read_fclib(folder / "increment_0004.hdf5").mu.size > 0


def test_problems_whose_run_is_not_there_are_left_alone(long, capsys):
    for name in ("run.vtkhdf", "history.csv", "tools.vtkhdf"):
        (long / "mu0.1" / name).unlink()
    before = files(long)
    assert study(long, "--increments", "1", "--fclib") == 2
    assert "holds contact problems of a run that is not there" in capsys.readouterr().err
    assert files(long) == before
