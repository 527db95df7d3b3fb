"""A database survives the file, and a damaged file is named."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

from palpate.benchmark.database import FIELDS, read, write
from palpate.errors import InputError

ARRAYS = [name for name in FIELDS if name != "prolongation"]


@pytest.fixture
def path(db, tmp_path):
    write(db, tmp_path / "database.h5")
    return tmp_path / "database.h5"


def test_round_trip_and_what_follows_from_the_arrays(db, path):
    again = read(path)
    for name in ARRAYS:
        assert np.array_equal(getattr(again, name), getattr(db, name)), name
    assert (again.prolongation != db.prolongation).nnz == 0
    assert again.material == db.material and again.config_digest == db.config_digest
    assert list(path.parent.iterdir()) == [path]
    assert db.peaks == pytest.approx([max(np.sqrt((u**2).sum(axis=1))) for u in db.fine], rel=1e-14)
    assert db.size == pytest.approx(0.2)


def missing(file, name):
    del file[f"{FIELDS[name].group}/{name}"]


def in_millimetres(file, name):
    file[f"{FIELDS[name].group}/{name}"].attrs["unit"] = "mm"


def of_another_version(file, name):
    file.attrs[name] = 99


def without(file, name):
    del file.attrs[name]


def ending_with(value):
    def change(file, name):
        file[f"{FIELDS[name].group}/{name}"][-1] = value

    return change


@pytest.mark.parametrize(
    ("names", "change", "says"),
    [
        (list(FIELDS), missing, "is missing; delete the file"),
        (list(FIELDS), in_millimetres, "has unit mm instead of "),
        (["nodes_fine_surface", "contact_normals", "force", "fine", "residual"], ending_with(np.nan), "has a NaN or"),
        (["nodes_fine_surface", "force", "residual"], ending_with(np.inf), "has a NaN or infinite value"),
        (["format"], of_another_version, "is 99"),
        (["young_pa"], without, "is missing"),
    ],
)
def test_what_is_wrong_in_a_file_is_named(path, names, change, says):
    whole = path.read_bytes()
    for name in names:
        path.write_bytes(whole)
        with h5py.File(path, "a") as file:
            change(file, name)
        with pytest.raises(InputError, match=f"database.h5: field {name} {says}"):
            read(path)


@pytest.mark.parametrize("name", ARRAYS)
def test_a_wrong_shape_is_named(db, tmp_path, name):
    array = getattr(db, name)
    wider = np.concatenate([array, array[..., :1]], axis=-1) if array.ndim > 1 else array[:, None]
    with pytest.raises(InputError, match=f"field {name} has "):
        write(replace(db, **{name: wider}), tmp_path / "x.h5")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [
        ("triangles", 10**6, "names a node that nodes_fine_surface does not have"),
        ("contact", -1, "names a node that coarse_nodes does not have"),
        ("contact", "inner", "names a node that is not on the coarse surface"),
        ("coarse_surface", 0, "is not increasing"),
        ("fine", 0.0, "has a sample in which nothing moves"),
    ],
)
def test_what_cannot_be_is_not_written(db, tmp_path, name, value, says):
    array = getattr(db, name).copy()
    array[-1] = np.setdiff1d(np.arange(len(db.coarse_nodes)), db.coarse_surface)[0] if value == "inner" else value
    with pytest.raises(InputError, match=f"field {name} {says}"):
        write(replace(db, **{name: array}), tmp_path / "x.h5")


def test_flipped_bytes_are_noticed(path):
    with h5py.File(path) as file:
        chunk = file["samples/fine"].id.get_chunk_info(0)
    with open(path, "r+b") as file:
        file.seek(chunk.byte_offset + chunk.size // 2)
        byte = file.read(1)
        file.seek(-1, 1)
        file.write(bytes([byte[0] ^ 0xFF]))
    with pytest.raises(InputError, match="field fine is damaged"):
        read(path)
