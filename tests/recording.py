"""A short march and its run on disk, which the tests of recording share."""

from dataclasses import fields
from functools import cache

import numpy as np

from bipot.forms import Tangent
from bipot.laws.flow import Flow
from bipot.marching import Control, Schedule, march
from bipot.paper import upsetting
from bipot.results import Existing, Recorder
from bipot.results.columns import COURSE, INCREMENT, SECONDS, Column, certificate, energies
from bipot.state import State

SCENE = upsetting(mu=0.3, elements=2, reduction=0.2)
SCHEDULE = Schedule(4, first=0.005, settling=1, growth=4.0)
CONTROL = Control(Tangent())
REDUCTION = Column("reduction", "of the height", lambda _, a: 0.2 * a.state.tau)
COLUMNS = (INCREMENT, REDUCTION, *energies("J", 1e-3), *COURSE, *certificate("J", 1e-3), SECONDS)
PARAMETERS = {"mu": 0.3, "elements": 2, "hardening": None, "form": "tangent"}
UNITS = {"length": "mm", "force": "N"}
HEADER = (
    "increment,reduction,work_J,elastic_J,plastic_J,friction_J,energy_error,passes,cuts,form,reason,"
    "route,contraction,coupling_steps,undetermined,below_resolution,"
    "equilibrium,tool_equilibrium,yield_violation,penetration,cone_violation,law,bipotential_gap_J,relative_gap,seconds"
)


def recorder(folder, existing=Existing.REFUSE, start=None, patience=0.0, **changed):
    """Of the march's scene; by default each increment is on disk once it is recorded."""
    return Recorder(
        folder, SCENE, COLUMNS, {**PARAMETERS, **changed}, UNITS, existing=existing, start=start, patience=patience
    )


def arrays(state):
    """Everything a state holds, its flow included."""
    own = [np.asarray(getattr(state, f.name)) for f in fields(State) if f.name != "flow"]
    return own + [np.asarray(getattr(state.flow, f.name)) for f in fields(Flow)]


@cache
def steps():
    """The increments of the march."""
    return tuple(march(SCENE, SCHEDULE, CONTROL))


def complete(path):
    """The folder, with the whole run."""
    with recorder(path) as out:
        for increment in steps():
            out.record(increment)
    return path
