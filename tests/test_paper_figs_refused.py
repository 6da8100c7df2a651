"""Figures of runs and tables of another kind: refused in a sentence that names the file and what it lacks."""

import pytest

from bipot import (
    Elasticity,
    FlatTool,
    Geometry,
    Perfect,
    Recorder,
    Scene,
    Schedule,
    Support,
    VonMises,
    block,
    brick,
    cylinder_3d,
    march,
    upsetting,
)
from bipot.errors import ResultsError
from bipot.results.columns import INCREMENT
from paper_figs import fig_block, fig_corner, fig_landings, fig_penalty_vs_conic, fig_speed_vs_error
from paper_figs.shown import shown
from tests.drawn import record


def punched(mesh, geometry):
    """A body on its base with one punch on its top."""
    d = mesh.dimension
    down = (0.0,) * (d - 1)
    supports = (Support("base", d - 1), Support("left", 0), *(() if d == 2 else (Support("front", 1),)))
    tool = FlatTool((*down, 4.0), (*down, -1.0), (*down, -0.04), ("top",), 0.1)
    return Scene(mesh, geometry, VonMises(Elasticity(2e5, 0.3), Perfect(200.0)), supports, (tool,))


MESHES = {
    "plane": (block(4.0, 4.0, 2, 2), Geometry.PLANE_STRAIN),
    "eighth": (brick(4.0, 4.0, 4.0, 2, 2, 2), Geometry.SOLID),
    "quarter": (cylinder_3d(4.0, 4.0, 1, 1, 1), Geometry.SOLID),
}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folders of runs by kind, each of an increment and with the columns that the figures read."""
    kept = {}

    def make(kind):
        if kind not in kept:
            kept[kind] = tmp_path_factory.mktemp(kind)
            scene = punched(*MESHES[kind]) if kind in MESHES else upsetting(mu=0.1, elements=2, reduction=0.02)
            record(kept[kind] / "mu0.1", scene, increments=1)
        return kept[kind]

    return make


@pytest.mark.parametrize(
    ("kind", "lacks"),
    [
        ("cylinder", "the geometry solid, the boundary right, the boundary back"),
        ("plane", "the geometry solid, the boundary back"),
        ("quarter", "the boundary right, the boundary back"),
    ],
)
def test_runs_of_other_bodies_are_no_upset_block(kind, lacks, made):
    with pytest.raises(ResultsError, match=rf"mu0\.1/run\.vtkhdf: .*studies\.block.*: lacks {lacks}$"):
        fig_block.figures(made(kind))
    with pytest.raises(SystemExit, match=f"lacks {lacks}"):
        fig_block.main(["--results", str(made(kind))])


@pytest.mark.parametrize(
    ("kind", "lacks"),
    [
        ("eighth", "the geometry axisymmetric, the boundary side"),
        ("plane", "the geometry axisymmetric, the boundary side"),
        ("quarter", "the geometry axisymmetric"),
    ],
)
def test_runs_of_other_bodies_are_no_upsetting(kind, lacks, made):
    with pytest.raises(ResultsError, match=rf"mu0\.1/run\.vtkhdf: .*studies\.upsetting.*: lacks {lacks}$"):
        shown(made(kind))


def test_a_run_without_the_columns_is_refused(tmp_path):
    scene = punched(*MESHES["eighth"])
    with Recorder(tmp_path / "mu0.1", scene, (INCREMENT,), {}, {}) as recorder:
        for accepted in march(scene, Schedule(1)):
            recorder.record(accepted)
    with pytest.raises(ResultsError, match=r"lacks the column reduction, the column force_N$"):
        fig_block.figures(tmp_path)


@pytest.mark.parametrize("figure", [fig_landings, fig_penalty_vs_conic, fig_speed_vs_error, fig_corner])
def test_tables_of_another_kind_are_refused(figure, tmp_path):
    (tmp_path / f"{figure.NAME}.csv").write_text("element,force\nq8,3.0\n")
    (tmp_path / f"{figure.NAME}.h5").write_text("")
    words = rf"{figure.NAME}\.csv: has no column '\w+': it is of another study or version; run: python -m studies"
    with pytest.raises(SystemExit, match=words):
        figure.main(["--results", str(tmp_path)])


def test_a_block_without_an_increment_is_refused(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        record(tmp_path / "mu0.1", punched(*MESHES["eighth"]), stop=0)
    with pytest.raises(ResultsError, match="no increment is recorded"):
        fig_block.figures(tmp_path)
