"""The lines of tools in a run's steps, and the file of them beside it."""

import shutil

import numpy as np
import pytest

import bipot
from bipot import (
    Circle,
    Elasticity,
    Geometry,
    Perfect,
    Profile,
    Schedule,
    ShapedTool,
    Turn,
    Union,
    VonMises,
    block,
    march,
)
from bipot.errors import ResultsError
from bipot.results import Existing, Recorder
from bipot.tools.surfaces import Plane
from tests.recording import recorder
from tests.scenes import scene


@pytest.fixture(scope="module")
def run(recorded):
    return bipot.results.open(recorded)


def test_the_lines_of_a_plane_are_where_it_goes(run):
    for step, travelled in ((run.at(0.0, by="tau"), 0.0), (run.at(), 1.0)):
        (line,) = step.tools
        assert line.tool == 0
        np.testing.assert_allclose(line.points[:, 1], 5 - travelled * 0.2 * 5, atol=1e-14)
        # The tool, above, is on the right.
        assert line.points[0, 0] > step.nodes[:, 0].max() > step.nodes[:, 0].min() > line.points[1, 0]


SURFACES = {
    "plane": Plane((0.0, 2.0), (0.6, -0.8)),
    "circle": Circle((0.5, 3.0), 1.0),
    "hollow": Circle((0.5, 3.0), 1.0, concave=True),
    "punch": Profile(((1.0, 4.0), (1.0, 2.0), (-1.0, 2.0), (-1.0, 4.0)), fillets=(0.5, 0.0)),
    "closed": Profile(((0.0, 0.0), (0.0, 2.0), (3.0, 2.0), (3.0, 0.0)), fillets=0.4, closed=True),
    "die": Profile(((-1.0, 0.0), (0.0, 0.0), (1.0, 1.0), (3.0, 1.0)), fillets=0.3),
}


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
def test_lines_are_on_the_surface_with_the_tool_on_the_right(surface):
    (line,) = surface.lines(np.array([0.0, 1.0]), 5.0)
    np.testing.assert_allclose(surface.distance(line).gap, 0.0, atol=1e-12)
    along = np.diff(line, axis=0)
    length = np.linalg.norm(along, axis=1)
    assert (length > 0).all()
    right = np.stack([along[:, 1], -along[:, 0]], axis=1) / length[:, None]
    middle = (line[1:] + line[:-1]) / 2
    # The chord of a round is off it by its sagitta.
    assert (np.abs(surface.distance(middle).gap) < 1e-3).all()
    assert (surface.distance(middle + 1e-2 * right).gap < 0).all()
    assert (surface.distance(middle - 1e-2 * right).gap > 0).all()


def test_lines_of_a_profile_hold_its_corners_and_its_whole_length():
    (line,) = SURFACES["closed"].lines(np.zeros(2), 1.0)
    np.testing.assert_array_equal(line[0], line[-1])
    length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    assert length == pytest.approx(2 * (2.2 + 1.2) + 2 * np.pi * 0.4, rel=1e-3)
    (open_,) = SURFACES["punch"].lines(np.zeros(2), 1.0)
    np.testing.assert_array_equal(open_[[0, -1]], [(1.0, 4.0), (-1.0, 4.0)])
    assert (np.abs(open_ - (-1.0, 2.0)).max(axis=1) == 0).sum() == 1
    two = Union((SURFACES["circle"], SURFACES["hollow"]))
    assert [len(one) for one in two.lines(np.zeros(2), 1.0)] == [121, 121]


def test_the_lines_of_a_tool_that_turns_turn_about_its_centre(tmp_path):
    roll = ShapedTool(
        surface=Profile(((2.0, 4.0), (0.0, 2.0), (-2.0, 4.0)), fillets=0.5),
        travel=(0.1, -0.2),
        candidates=("top",),
        mu=0.1,
        turn=Turn(-0.2, (0.0, 4.0)),
    )
    given = scene(
        geometry=Geometry.PLANE_STRAIN,
        mesh=block(1.0, 1.0, 2, 2),
        material=VonMises(Elasticity(1000.0, 0.3), Perfect(5.0)),
        tools=(roll,),
    )
    with Recorder(tmp_path, given, (), {}, {}) as out:
        for accepted in march(given, Schedule(2)):
            out.record(accepted)
    history = bipot.results.open(tmp_path)
    for step in (history.at(0.0, by="tau"), history.at(0.5), history.at()):
        (line,) = step.tools
        pose = roll.pose(step.tau)
        np.testing.assert_allclose(roll.distance(line.points, pose), 0.0, atol=1e-12)
    (path,) = tmp_path.glob("tools.vtkhdf")
    written = path.read_bytes()
    path.unlink()
    assert history.write_tools() == path
    assert path.read_bytes() == written


def test_a_run_without_tools_has_no_file_of_them(tmp_path):
    given = scene(tools=(), mesh=block(1.0, 1.0, 1, 1))
    with Recorder(tmp_path, given, (), {}, {}):
        pass
    assert bipot.results.open(tmp_path).at().tools == []
    assert bipot.results.open(tmp_path).write_tools() is None
    assert [path.name for path in tmp_path.iterdir() if "tools" in path.name] == []


def test_the_tools_of_a_copy_do_not_replace_those_of_the_run_beside_it(recorded, tmp_path):
    shutil.copytree(recorded, tmp_path / "run")
    file = tmp_path / "run" / "run.vtkhdf"
    shutil.copy(file, file.with_name("copy.vtkhdf"))
    tools = file.with_name("tools.vtkhdf")
    tools.write_bytes(b"of the run")
    assert bipot.results.open(file.with_name("copy.vtkhdf")).write_tools() == file.with_name("copy_tools.vtkhdf")
    assert tools.read_bytes() == b"of the run"


def test_the_file_of_tools_of_an_overwritten_run_goes_with_it(recorded, tmp_path):
    (tmp_path / "tools.vtkhdf").write_bytes(b"of another run")
    with recorder(tmp_path, Existing.OVERWRITE):
        assert not (tmp_path / "tools.vtkhdf").exists()
    assert (tmp_path / "tools.vtkhdf").stat().st_size > 1000


def test_a_file_of_tools_that_cannot_be_written_is_said(tmp_path, monkeypatch):
    def full(*_):
        raise ResultsError("tools.vtkhdf: cannot be written (no space)")

    monkeypatch.setattr("bipot.results.vtkhdf.write_tools", full)
    with pytest.raises(ResultsError, match="no space"), recorder(tmp_path):
        pass
    with pytest.raises(ZeroDivisionError), recorder(tmp_path, Existing.RESUME):
        raise ZeroDivisionError
    assert len(bipot.results.open(tmp_path)) == 0
