"""A march again is the same march to the last bit; a long one takes no more memory, and an abandoned one none."""

import gc
import itertools
import os
import subprocess
import sys
import threading
import time
import weakref
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from bipot.forms import Dissipation, Newton
from bipot.marching import Control, march
from bipot.paper import upsetting
from bipot.schedule import Schedule
from tests.courses import FORMS, digest, moving, unlike, upset

ROOT = Path(__file__).parents[1]

WILD = """
import itertools, time
jumps = itertools.cycle([0.0, 1e6, -1e6, 3e9])
for name in ("perf_counter", "process_time", "monotonic", "time"):
    setattr(time, name, lambda: next(jumps))
from tests.courses import FORMS, digest, upset
print(digest(upset(form, elements=1) for form in FORMS.values()))
"""
"""Clocks that jump to and fro by years."""


@pytest.mark.parametrize("name", FORMS)
def test_a_march_is_the_same_by_turns_with_another_and_in_a_thread_beside_it(name):
    asked, other = upset(FORMS[name]), moving(Newton())

    def seen():
        return [asked.seen(accepted) for accepted in asked.run()]

    alone = seen()
    turns = [
        asked.seen(accepted)
        for accepted, _ in zip(march(asked.scene, asked.schedule, asked.control), endless(other), strict=False)
    ]
    assert unlike(alone, turns) == []
    with ThreadPoolExecutor(3) as pool:
        busy = pool.submit(other.run)
        for beside in [pool.submit(seen) for _ in range(2)]:
            assert unlike(alone, beside.result()) == []
        busy.result()


def endless(asked):
    while True:
        yield from march(asked.scene, asked.schedule, asked.control)


@pytest.mark.slow
def test_no_clock_and_no_order_of_hashes_decides():
    """In a process of its own, in which both are others."""
    ran = subprocess.run(
        [sys.executable, "-c", WILD],
        cwd=ROOT,
        env=os.environ | {"PYTHONHASHSEED": "7"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert ran.stdout.strip() == digest(upset(form, elements=1) for form in FORMS.values())


LONG, SETTLED = 1000, 200
"""Increments of a long march, and after how many of them nothing may grow."""

GROWN = 2.0
"""MB that a march may hold more of at its end: less than what 800 states of one element take, 2.7 MB."""


def long(form):
    """Small increments of one element."""
    return march(upsetting(mu=0.1, elements=1, reduction=0.02), Schedule(LONG), Control(form, ()))


def resident():
    """Memory of the process in MB, 0 where it cannot be told."""
    told = Path("/proc/self/statm")
    return int(told.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6 if told.is_file() else 0.0


@pytest.mark.slow
@pytest.mark.serial
@pytest.mark.parametrize("form", [Newton(), Dissipation()], ids=lambda form: form.name.value)
def test_a_thousand_increments_keep_the_last_alone_and_take_as_long_as_the_first(form):
    """By turns with a march that is young, so that a machine that slows meanwhile slows both."""
    states, memory, old, young = list[weakref.ref](), dict[int, float](), list[float](), list[float]()
    beside = long(form)
    for _ in itertools.islice(beside, SETTLED):
        pass
    spent = time.process_time()
    for accepted in long(form):
        old.append(time.process_time() - spent)
        states.append(weakref.ref(accepted.state))
        if accepted.number in (SETTLED, LONG):
            gc.collect()
            memory[accepted.number] = resident()
        if accepted.number > LONG - SETTLED:
            spent = time.process_time()
            next(beside)
            young.append(time.process_time() - spent)
        spent = time.process_time()
    assert sum(state() is not None for state in states) <= 2
    assert memory[LONG] - memory[SETTLED] < GROWN
    assert np.median(old[-SETTLED:]) < 1.3 * np.median(young)


@pytest.mark.parametrize("closed", [True, False], ids=["closed", "abandoned"])
def test_a_march_that_is_left_half_way_leaves_nothing(closed):
    """No thread, no open file, nothing of the scene made ready."""
    before = threading.active_count(), opened()
    going_on = long(Newton())
    accepted = next(going_on)
    system = weakref.ref(accepted.solved.iterate.increment.system)
    assert system() is not None
    if closed:
        going_on.close()
        assert list(going_on) == []
    del going_on, accepted
    gc.collect()
    assert system() is None
    assert (threading.active_count(), opened()) == before


def opened():
    """Files that the process has open, 0 where it cannot be told."""
    told = Path("/proc/self/fd")
    return len(list(told.iterdir())) if told.is_dir() else 0
