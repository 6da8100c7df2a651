"""Checked reading of HDF5: what is asked comes as it is stored, and what is not as it should be is refused by name."""

import io

import h5py
import numpy as np
import pytest

from bipot.errors import ResultsError, SceneError
from bipot.hdf5 import checked
from bipot.hdf5.checked import opened

VALUES = np.random.default_rng(3).normal(size=(7, 3, 5))
STORAGES = {
    "in one piece": {},
    "a row a chunk": {"chunks": (1, 3, 5), "maxshape": (None, 3, 5)},
    "packed": {"chunks": (2, 2, 4), "compression": "gzip", "shuffle": True, "fletcher32": True},
}


@pytest.fixture
def source():
    """A file in memory."""
    out = io.BytesIO()
    with h5py.File(out, "w") as file:
        for name, options in STORAGES.items():
            file.create_dataset(f"values/{name}", data=VALUES, **options)
        file["values/one"], file["values/many"] = np.int16(-3), np.array([7], ">u4")
        file["text"] = np.frombuffer('{"mu": "µ"}'.encode(), np.uint8)
        file["latin"] = np.frombuffer("µ".encode("latin-1"), np.uint8)
        file["large"] = np.array([2**63], np.uint64)
        file["holes"] = np.array([1.0, np.nan])
        file["soft"], file["again"] = h5py.SoftLink("/values"), file["values"]
        file["values"].attrs.update(count=np.int32(4), counts=[1, 2], words="4", none=h5py.Empty("i4"))
    return out


def test_a_chunk_whose_filter_was_skipped_comes_as_it_is_stored():
    """As writers do with noise, which cannot be packed."""
    out, noise = io.BytesIO(), np.frombuffer(np.random.default_rng(5).bytes(4096), np.uint8)
    with h5py.File(out, "w") as file:
        made = file.create_dataset("noise", (4096,), np.uint8, chunks=(4096,), compression="gzip")
        made.id.write_direct_chunk((0,), noise.tobytes(), filter_mask=1)
    with opened(out, ResultsError) as file:
        np.testing.assert_array_equal(file.array("noise", "u", (4096,)), noise)


@pytest.mark.parametrize("name", STORAGES)
def test_numbers_come_as_they_are_stored(source, name):
    with opened(source, ResultsError) as file:
        found = file.array(f"values/{name}", "f", (7, None, 5))
        np.testing.assert_array_equal(found, VALUES)
        for start, stop in ((0, 1), (2, 5), (6, 7), (3, 3), (0, 7)):
            rows = file.group("values").rows(name, "f", start, stop, (3, 5))
            np.testing.assert_array_equal(rows, VALUES[start:stop])
        assert file.length(f"values/{name}") == 7


def test_single_numbers_attributes_names_and_texts(source):
    with opened(source, ResultsError) as file:
        group = file.group("values")
        assert (group.integer("one"), group.integer("many", 0, 7), group.attribute("count")) == (-3, 7, 4)
        assert sorted(group.names()) == sorted([*STORAGES, "many", "one"])
        assert ("values/one" in file, "values/two" in file, "two" in file) == (True, False, False)
        assert file.text("text") == '{"mu": "µ"}'
        assert file.array("large", "fu", (1,)) == 2.0**63
        assert np.isnan(file.array("holes", "f", (2,), finite=False)[1])


REFUSED = {
    "/values/none is missing": lambda f: f.array("values/none", "f", (7,)),
    "/values/ is missing": lambda f: f.array("values/", "f", (7,)),
    "/values/one/x is missing": lambda f: f.array("values/one/x", "f", (7,)),
    "/values/one is no group": lambda f: f.group("values/one"),
    "/values is no dataset": lambda f: f.length("values"),
    "/soft is a link to elsewhere": lambda f: f.group("soft"),
    "/soft/one is a link to elsewhere": lambda f: f.integer("soft/one"),
    "/values/one: its shape = (): must be of one dimension": lambda f: f.length("values/one"),
    "/values/packed: its shape = (7, 3, 5): must be (7, 3)": lambda f: f.array("values/packed", "f", (7, 3)),
    "/values/packed: its shape = (7, 3, 5): must be (any, 3, 4)": lambda f: f.rows("values/packed", "f", 0, 1, (3, 4)),
    "/values/packed: its type = a float of 8 bytes: must be signed integers": lambda f: f.array(
        "values/packed", "i", (7, 3, 5)
    ),
    "/values/packed: number of its rows = 7: must be at least 8": lambda f: f.rows("values/packed", "f", 6, 8, (3, 5)),
    "/values/one = -3: must be in [0, inf]": lambda f: f.integer("values/one", 0),
    "/values/many = 7: must be 8": lambda f: f.integer("values/many", 8, 8),
    "/large[0] = 9223372036854775808: must be in [-inf, 9223372036854775807]": lambda f: f.array("large", "u", (1,)),
    "/holes[1] = nan: must be finite": lambda f: f.array("holes", "f", (2,)),
    "/holes[0] = 1.0: must be in [2, inf]": lambda f: f.array("holes", "f", (2,), finite=False, least=2),
    "/latin cannot be read": lambda f: f.text("latin"),
    "/text: its bytes = 12: must be at most 5": lambda f: f.text("text", 5),
    "/holes: its type": lambda f: f.text("holes"),
    "/values: attribute mass = missing": lambda f: f.group("values").attribute("mass"),
    "/values: attribute counts: its shape = (2,)": lambda f: f.group("values").attribute("counts"),
    "/values: attribute words: its type = a string": lambda f: f.group("values").attribute("words"),
    "/values: attribute none": lambda f: f.group("values").attribute("none"),
}


@pytest.mark.parametrize("words", REFUSED)
def test_what_is_not_as_asked_is_refused_by_name(source, words):
    with opened(source, ResultsError) as file, pytest.raises(ResultsError) as refusal:
        REFUSED[words](file)
    assert f"the open file: {words}" in str(refusal.value)


def test_only_the_rows_that_are_asked_are_counted(source):
    with opened(source, ResultsError, largest=8 * 15 * 2) as file:
        assert file.rows("values/packed", "f", 4, 6, (3, 5)).shape == (2, 3, 5)
        with pytest.raises(ResultsError, match="packed: its bytes = 360: must be at most 240"):
            file.rows("values/packed", "f", 4, 7, (3, 5))


def test_names_without_end_are_refused(source, monkeypatch):
    monkeypatch.setattr(checked, "MOST_NAMES", 4)
    with opened(source, ResultsError) as file, pytest.raises(ResultsError, match="/values: number of its names = more"):
        file.group("values").names()


def test_links_of_every_form_are_not_followed(tmp_path):
    """Few links are in the header of their group; many are in a heap, which is refused unless it is asked for."""
    for libver in ("earliest", "v108", "latest"):
        with h5py.File(tmp_path / f"{libver}.h5", "w", libver=(libver, "latest")) as file:
            file["there"], file["here"] = h5py.ExternalLink(str(tmp_path / "b.h5"), "x"), 3
            file["many/there"] = h5py.ExternalLink(str(tmp_path / "b.h5"), "x")
            for k in range(20):
                file[f"many/{k}"] = k
        with opened(tmp_path / f"{libver}.h5", ResultsError) as file:
            assert file.integer("here") == 3
            with pytest.raises(ResultsError, match=r"/there is a link to elsewhere"):
                file.integer("there")
            with pytest.raises(ResultsError, match=r"/many: heap of its links or attributes"):
                file.group("many")
        with opened(tmp_path / f"{libver}.h5", ResultsError, newest=True) as file:
            assert file.integer("many/7") == 7
            with pytest.raises(ResultsError, match=r"/many/there is a link to elsewhere"):
                file.integer("many/there")


def test_errors_of_who_reads_are_theirs(tmp_path, source):
    """Only what the file does is said as the file's."""
    (tmp_path / "a.h5").write_bytes(source.getvalue())
    for error in (SceneError("mu"), ValueError("mu"), KeyError("mu")):
        with pytest.raises(type(error), match="mu"), opened(tmp_path / "a.h5", ResultsError):
            raise error
    with opened(str(tmp_path / "a.h5"), ResultsError) as file, pytest.raises(ResultsError, match=r"a\.h5: /x is miss"):
        file.group("x")
