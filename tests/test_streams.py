"""Standard output and error that nobody reads, or that are closed, end no study and spoil no table."""

import io
import os
import shlex
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from studies.command import say
from studies.tables import read_csv

ROOT = Path(__file__).parents[1]


def study_with(out, folder, error=subprocess.PIPE):
    command = [sys.executable, "-m", "studies.penalty_round_off", "--fast", "--out", str(folder)]
    return subprocess.run(command, cwd=ROOT, stdout=out, stderr=error, text=True, check=False)


@pytest.fixture
def broken_pipe():
    """The end to write to of a pipe that nobody reads."""
    reading, writing = os.pipe()
    os.close(reading)
    yield writing
    with suppress(OSError):
        os.close(writing)


@pytest.mark.slow
def test_a_pipe_that_nobody_reads_ends_nothing(broken_pipe, tmp_path):
    ended = study_with(broken_pipe, tmp_path)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert len(read_csv(tmp_path / "penalty_round_off.csv", "")) == 2


@pytest.mark.slow
def test_no_pipe_at_all_ends_nothing(broken_pipe, tmp_path):
    ended = study_with(broken_pipe, tmp_path, error=broken_pipe)
    assert ended.returncode == 0
    assert len(read_csv(tmp_path / "penalty_round_off.csv", "")) == 2


@pytest.mark.slow
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"])
def test_closed_streams_end_nothing_and_nothing_goes_into_files_in_their_place(closed, tmp_path):
    command = f"{sys.executable} -m studies.penalty_round_off --fast --out {tmp_path} {closed}"
    ended = subprocess.run(["sh", "-c", command], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert len(read_csv(tmp_path / "penalty_round_off.csv", "")) == 2


def test_what_compiled_code_prints_goes_into_no_file_in_the_place_of_a_closed_stream(tmp_path):
    """The first file that is opened would have the number of standard output."""
    (tmp_path / "studies").mkdir()
    shutil.copy(ROOT / "studies" / "__init__.py", tmp_path / "studies")
    code = "import os\nwith open('lines.csv', 'w') as file:\n    os.write(1, b'printed')\n    file.write('kept')\n"
    (tmp_path / "studies" / "planted.py").write_text(code)
    subprocess.run(["sh", "-c", f"{shlex.quote(sys.executable)} -m studies.planted >&-"], cwd=tmp_path, check=True)
    assert (tmp_path / "lines.csv").read_text() == "kept"


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize(
    "told", [["-m", "studies.penalty_round_off"], ["-c", "from bipot import command; command.main()"]]
)
def test_a_help_that_nobody_reads_is_quiet(broken_pipe, unbuffered, told):
    command = [sys.executable, *told, "--help"]
    env = os.environ | {"PYTHONUNBUFFERED": unbuffered}
    ended = subprocess.run(
        command, cwd=ROOT, stdout=broken_pipe, stderr=subprocess.PIPE, text=True, check=False, env=env
    )
    assert (ended.returncode, ended.stderr) == (0, "")


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a full disk by name")
def test_a_full_disk_under_standard_output_is_said_and_the_table_is_there(tmp_path):
    with Path("/dev/full").open("w") as full:
        ended = study_with(full, tmp_path)
    assert ended.returncode == 2
    assert ended.stderr.startswith("error: ")
    assert ended.stderr.count("\n") == 1
    assert len(read_csv(tmp_path / "penalty_round_off.csv", "")) == 2


def test_sigterm_ends_a_study_like_ctrl_c(tmp_path):
    command = [sys.executable, "-m", "studies.hard_cases", "--out", str(tmp_path)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=120)
    assert (process.returncode, said) == (130, "stopped; what was computed is on disk\n")
    assert len(read_csv(tmp_path / "hard_cases.csv", "")) >= 1


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_letters_that_a_stream_does_not_know_end_nothing(encoding):
    stream = io.TextIOWrapper(io.BytesIO(), encoding)
    say("results in \u20ac/\udcff", to=stream)
    written = stream.buffer.getvalue().decode(encoding)
    assert written.startswith("results in ")
    assert written.endswith("/\\udcff\n")


def test_where_there_is_no_stream_nothing_is_said(monkeypatch):
    monkeypatch.setattr("sys.stdout", None)
    say("to nobody")
