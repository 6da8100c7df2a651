"""Run files that are damaged, checksums and all, and what of them is read."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from bipot.results import open as open_results
from tests.corpus.case import Case, damaged


def read_all(path):
    """Everything that a run file tells."""
    run = open_results(path)
    mesh = run.mesh
    courses = [run.start, *(run.course(row) for row in range(len(run)))]
    nodal = [run.nodal(name) for name in ("displacement", "gap", "status", "stress_zz")]
    tools = [run.snapshot(row).tools for row in range(len(run))]
    return run, mesh, courses, nodal, run.cell("stress"), tools


def replaced(name, make):
    """The dataset with other content, checksums and all."""

    def change(file):
        values = make(file[name][...])
        del file[name]
        file[name] = values

    return change


def about(**changed):
    return replaced(
        "bipot/about",
        lambda old: np.frombuffer(json.dumps({**json.loads(bytes(old)), **changed}).encode(), dtype=np.uint8),
    )


def at(place, value):
    def make(values):
        values[place] = value
        return values

    return make


def attribute(group, name, value):
    def change(file):
        file[group].attrs[name] = value

    return change


def soft(file):
    del file["bipot/steps/stress"]
    file["bipot/steps/stress"] = h5py.SoftLink("/bipot/steps/plastic_strain")


def outside(file):
    del file["bipot/steps/stress"]
    file["bipot/steps/stress"] = h5py.ExternalLink("other.h5", "stress")


def external(file):
    shape = file["bipot/steps/peeq"].shape
    del file["bipot/steps/peeq"]
    file.create_dataset("bipot/steps/peeq", shape, "f8", external=[("/etc/passwd", 0, h5py.h5f.UNLIMITED)])


def virtual(file):
    shape = file["bipot/steps/peeq"].shape
    del file["bipot/steps/peeq"]
    layout = h5py.VirtualLayout(shape, "f8")
    layout[...] = h5py.VirtualSource(".", "bipot/steps/flow_peeq", shape)
    file.create_virtual_dataset("bipot/steps/peeq", layout)


def huge(file):
    del file["bipot/steps/stress"]
    file.create_dataset("bipot/steps/stress", (3, 1, 10**9, 4), "f8", chunks=(1, 1, 100, 4))


KINDS = {
    "no steps": (attribute("VTKHDF/Steps", "NSteps", 0), "NSteps"),
    "a negative count": (attribute("VTKHDF/Steps", "NSteps", -3), "NSteps"),
    "more steps than there are": (attribute("VTKHDF/Steps", "NSteps", 10**9), "history_ends"),
    "a count of text": (attribute("VTKHDF/Steps", "NSteps", "many"), "NSteps"),
    "a count of floats": (attribute("VTKHDF/Steps", "NSteps", 2.5), "NSteps"),
    "another format": (attribute("bipot", "format", 99), "format"),
    "nothing of ours": (lambda file: file.__delitem__("bipot"), "bipot"),
    "no JSON": (replaced("bipot/about", lambda old: old[:-1]), "about"),
    "JSON of a list": (replaced("bipot/about", lambda _: np.frombuffer(b"[]", dtype=np.uint8)), "parameters"),
    "JSON nested too deep": (replaced("bipot/about", lambda _: np.full(10**5, ord("["), dtype=np.uint8)), "about"),
    "no text": (replaced("bipot/about", lambda old: np.full(9, 0xFF, dtype=np.uint8)), "about"),
    "parameters of text": (about(parameters="none"), "parameters"),
    "boundaries that are not there": (about(boundaries=["a", "b", "c", "d", "e", "f"]), "boundaries"),
    "boundaries of numbers": (about(boundaries=[1, 2, 3, 4]), "boundaries"),
    "ends that go back": (replaced("bipot/history_ends", at(1, 3)), "history_ends"),
    "ends beyond the end": (replaced("bipot/history_ends", at(2, 10**6)), "history"),
    "a row too few": (replaced("bipot/history", lambda old: np.where(old == 10, 32, old).astype(np.uint8)), "history"),
    "times that go back": (replaced("VTKHDF/Steps/Values", at(1, 1.0)), "Values"),
    "times beyond the path": (replaced("VTKHDF/Steps/Values", at(2, 7.0)), "Values"),
    "times of nothing": (replaced("VTKHDF/Steps/Values", at(2, np.nan)), "Values"),
    "a stress of nothing": (replaced("bipot/steps/stress", at((2, 0, 0, 0), np.nan)), "stress"),
    "an infinite gap": (replaced("bipot/steps/gap", at((1, 0), np.inf)), "gap"),
    "a plastic strain of another shape": (
        replaced("bipot/steps/plastic_strain", lambda old: old[:, :, :2]),
        "plastic_strain",
    ),
    "forces of other candidates": (replaced("bipot/steps/contact_force", lambda old: old[:, 1:]), "contact_force"),
    "positions of fewer nodes": (replaced("VTKHDF/Points", lambda old: old[:-3]), "Points"),
    "a stress of whole numbers": (replaced("bipot/steps/stress", lambda old: old.astype(int)), "stress"),
    "a stress of texts": (
        replaced("bipot/steps/stress", lambda old: np.full(old.shape, b"text", dtype="S4")),
        "stress",
    ),
    "lines of tools beyond their points": (replaced("bipot/tools/starts", at(1, 99)), "starts"),
    "lines of tools that go back": (replaced("bipot/tools/starts", lambda old: old[::-1]), "starts"),
    "lines of a tool that is not there": (replaced("bipot/tools/tool", at(0, 1)), "tool"),
    "a pose of nothing": (replaced("bipot/steps/pose", at((1, 0, 1), np.nan)), "pose"),
    "an average of nothing": (replaced("VTKHDF/PointData/stress", at((-1, 1), np.nan)), "stress"),
    "fewer steps of one field": (replaced("bipot/steps/du", lambda old: old[:-1]), "du"),
    "elements of other nodes": (replaced("bipot/mesh/elements", lambda old: old + 5), "mesh"),
    "nodes of nothing": (replaced("bipot/mesh/nodes", at((0, 0), np.nan)), "nodes"),
    "a negative number of increments": (replaced("bipot/steps/number", at(1, -1)), "number"),
    "energies of nothing": (replaced("bipot/steps/energies", at((1, 0), np.nan)), "energies"),
    "a largest force below one": (replaced("bipot/steps/largest", at(2, 1e-3)), "largest"),
    "a field that is missing": (lambda file: file.__delitem__("bipot/steps/peeq"), "peeq"),
    "a soft link": (soft, "stress"),
    "an external link": (outside, "bipot/steps"),
    "external storage": (external, "peeq"),
    "a virtual dataset": (virtual, "peeq"),
    "a declared size": (huge, "stress"),
    "a group for a field": (
        lambda file: (file.__delitem__("bipot/steps/gap"), file.create_group("bipot/steps/gap")),
        "gap",
    ),
}


def cases(valid: Path, folder: Path) -> Iterator[Case]:
    """A file a kind."""
    for kind, (change, field) in KINDS.items():
        yield from damaged(valid, folder, {kind: changing(change)}, field)


def changing(change: Callable[[Any], object]) -> Callable[[Path], None]:
    """The damage that a function of the open file does."""

    def damage(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            change(file)

    return damage
