"""A run of a thousand increments: flat in memory, linear in its file and in time; nothing stays open after it."""

import gc
import os
import subprocess
import sys
from itertools import islice, pairwise
from pathlib import Path

import pytest

from bipot.forms import Newton
from bipot.marching import Control, Schedule, march
from bipot.paper import upsetting
from bipot.results import Recorder
from bipot.results import open as open_results
from bipot.results.columns import INCREMENT

SCENE = upsetting(mu=0.1, elements=1, reduction=0.2)

RUN = """
import resource, sys, time
from pathlib import Path
from bipot import Control, Newton, Recorder, Schedule, march, upsetting

folder, scene = Path(sys.argv[1]), upsetting(mu=0.1, elements=1, reduction=0.2)
with Recorder(folder, scene, (), {}, {}, patience=0) as out:
    spent = 0.0
    fifth = int(sys.argv[2]) // 5
    for accepted in march(scene, Schedule(5 * fifth), Control(Newton()), out.start):
        began = time.process_time()
        out.record(accepted)
        spent += time.process_time() - began
        if accepted.number % fifth == 0:
            size = (folder / "run.vtkhdf").stat().st_size
            print(accepted.number, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, size, spent)
"""


@pytest.mark.slow
@pytest.mark.parametrize("increments", [400, 1000])
def test_a_long_run_takes_no_more_memory_than_a_fifth_of_it_and_five_times_the_file(increments, tmp_path):
    pytest.importorskip("resource")
    fifth = increments // 5
    command = [sys.executable, "-c", RUN, str(tmp_path / "run"), str(increments)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    rows = [[float(word) for word in line.split()] for line in said.splitlines()]
    number, memory, size, spent = zip(*rows, strict=True)
    assert number == tuple(fifth * k for k in range(1, 6))
    # kB: what HDF5 keeps of its trees of chunks grows by a little.
    assert memory[-1] - memory[0] < 8_000
    a_step = [(after - before) / fifth for before, after in pairwise(size)]
    assert max(a_step) < 1.5 * min(a_step)
    # The processor's time, for others have the machine too: squares of the number would be five times as much.
    assert spent[-1] - spent[-2] < 2 * (spent[1] - spent[0])
    history = open_results(tmp_path / "run")
    assert len(history) == increments
    assert history.complete
    assert history.state(increments - 1).tau == 1.0


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="asks the system for what is open")
def test_what_an_aborted_march_had_open_is_closed(tmp_path):
    def aborted(folder):
        with Recorder(folder, SCENE, (INCREMENT,), {}, {}) as out:
            for accepted in islice(march(SCENE, Schedule(5), Control(Newton()), out.start), 2):
                out.record(accepted)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        aborted(tmp_path / "first")
    before = os.listdir("/proc/self/fd")
    for k in range(5):
        with pytest.raises(KeyboardInterrupt):
            aborted(tmp_path / str(k))
    gc.collect()
    assert len(os.listdir("/proc/self/fd")) <= len(before)
    assert len(open_results(tmp_path / "3")) == 2
