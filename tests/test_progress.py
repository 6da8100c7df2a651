"""Progress on a terminal and nowhere else; imports without optional extras."""

import io
import subprocess
import sys

from studies.progress import Bar, Progress, terminal


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_progress_is_silent_unless_stderr_is_a_terminal(monkeypatch):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    assert type(terminal()) is Progress
    # Closed, as where a study is started by a desktop.
    monkeypatch.setattr(sys, "stderr", None)
    assert type(terminal()) is Progress
    monkeypatch.setattr(sys, "stderr", Terminal())
    bar = terminal()
    assert isinstance(bar, Bar)
    bar.start("mu = 0.3")
    bar.advance(0.25, "F = 30 kN")
    bar.advance(1.0)
    bar.close()
    assert "mu = 0.3 100 %" in sys.stderr.getvalue()


def test_silence_writes_nothing(capfd):
    silent = Progress()
    silent.start("run")
    silent.advance(0.5, "note")
    silent.close()
    assert capfd.readouterr() == ("", "")


def test_the_library_imports_without_its_optional_extras():
    code = "import sys; sys.modules['matplotlib'] = sys.modules['tqdm'] = None; import bipot, bipot.results, bipot.plot"
    subprocess.run([sys.executable, "-c", code], check=True)
