"""Dataclasses and named tuples come back from files bit for bit, or not at all."""

from dataclasses import dataclass, fields, is_dataclass
from typing import NamedTuple

import h5py
import numpy as np
import pandas as pd
import pytest
from scipy import sparse

from palpate.bodies.body import Body, nest
from palpate.bodies.body_file import load
from palpate.bodies.material import Material, Tissue
from palpate.bodies.organs import SmoothSurface
from palpate.bodies.simple_shapes import box, sheet
from palpate.bodies.supports import Bed
from palpate.errors import InputError
from palpate.scenes.motion import Motion, Moved
from palpate.stores import store, stored

SOFT = Material(3000.0, 0.3, 1000.0)
UP = np.array([0.0, 0.0, 1.0])


class Pulled(NamedTuple):
    force: np.ndarray
    reached: bool


@dataclass(frozen=True, eq=False)
class Truth:
    """Each kind of field that no body and no motion has."""

    pulled: Pulled
    rejected: np.ndarray
    mean: float
    nodes: int
    limits: tuple[float, int, str, None]
    phases: np.ndarray
    matrices: list[sparse.csr_array]


def truth() -> Truth:
    pulled = Pulled(np.array([[-0.0, np.nan, np.inf]], dtype=np.float32), False)
    rejected = np.array(["", "det F ≤ 0", "x" * 1000], dtype=object)
    matrix = sparse.csr_array(np.diag([1.0, 0.0, 2.0])[:2])
    return Truth(pulled, rejected, 0.1 + 0.2, 2**40, (1.0, 1, "µ", None), np.array([True, False]), [matrix])


def organ() -> Body:
    """A body with all that a body can have."""
    mesh, bed, round_off = box([0.1, 0.1, 0.1], [1, 1, 1]), Bed(UP, 0.8, 1e5, UP), SmoothSurface("cylinder", 0.03)
    tissue = Tissue((SOFT, Material(1e4, 0.45, 1100.0, "stvk")), np.arange(len(mesh.tetrahedra)) % 2)
    body = nest("block", mesh, 1, np.empty(0, dtype=int), SOFT, bed=bed, regions=tissue)
    densities = [1000.0 + level.nodes[:, 0] for level in body.levels]
    return Body(*(vars(body) | {"densities": densities, "smooth": round_off}).values())


def cloth() -> Body:
    return nest("cloth", sheet([0.3, 0.2], [2, 2], 0.001), 0, np.array([0]), SOFT)


def press() -> Motion:
    mesh, times = box([0.1, 0.1, 0.1], [1, 1, 1]), np.linspace(0.0, 1.0, 3)
    things = [Moved(name, "ball", 0.01, np.zeros((3, 1, 3)), np.empty((0, 3), dtype=int)) for name in "cab" * 5]
    contacts = pd.DataFrame(
        {"first": ["box", "floor"], "gap_m": [1e-4, np.nan], "node": [3, 4], "stick": [True, False]}
    )
    positions, cells = np.repeat(mesh.nodes[None], 3, axis=0), (mesh.triangles, mesh.tetrahedra)
    energy = pd.DataFrame({"time_s": times})
    return Motion("press", times, positions, mesh.nodes, *cells, np.arange(3), energy, tuple(things), contacts=contacts)


def plain(found):
    """Return what tells whether two are the same to the bit."""
    if isinstance(found, np.ndarray):
        return found.dtype, found.shape, found.tolist() if found.dtype == object else found.tobytes()
    if isinstance(found, pd.DataFrame):
        found = [len(found), *(each for pair in found.items() for each in pair)]
    if isinstance(found, pd.Series):
        return found.dtype, plain(found.to_numpy())
    if isinstance(found, sparse.csr_array):
        return found.shape, plain([found.data, found.indices, found.indptr])
    if is_dataclass(found):
        return type(found), plain([getattr(found, field.name) for field in fields(found)])
    return type(found), [plain(each) for each in found] if isinstance(found, list | tuple) else found


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("make", [truth, organ, cloth, press])
def test_all_comes_back_bit_for_bit_from_the_same_bytes_each_time(make, compressed, tmp_path):
    found, path, again = make(), tmp_path / "deep/found.h5", tmp_path / "again.h5"
    for each in (path, again):
        store(found, each, compressed)
    assert plain(load(path) if isinstance(found, Body) else stored(type(found), path)) == plain(found)
    assert path.read_bytes() == again.read_bytes()


def test_a_whole_number_for_a_float_comes_back_as_one(tmp_path):
    store(Material(3000, 0.3, 1000), tmp_path / "soft.h5")
    assert [type(each) for each in vars(stored(Material, tmp_path / "soft.h5")).values()] == [float, float, float, str]


def drop(path):
    with h5py.File(path, "a") as file:
        del file["positions"]


def flip(path):
    with h5py.File(path) as file:
        offset = file["positions"].id.get_chunk_info(0).byte_offset
    held = bytearray(path.read_bytes())
    held[offset + 20] ^= 1
    path.write_bytes(held)


@pytest.mark.parametrize(
    ("harm", "said"),
    [
        (drop, r"m\.h5 is damaged \(.*'positions' doesn't exist.*\); delete it and type make\.$"),
        (flip, r"m\.h5 is damaged \(.*\); delete it and type make\.$"),
        (lambda path: path.write_bytes(path.read_bytes()[:3000]), r"m\.h5 is damaged \(.*truncated.*\); delete it"),
        (lambda path: path.unlink(), r"m\.h5 is missing; type make, which makes it\.$"),
        (lambda path: store(truth(), path), r"m\.h5 is of another version \(in /\); delete it and type make\.$"),
    ],
)
def test_a_file_that_is_damaged_or_of_another_layout_is_refused(harm, said, tmp_path):
    store(press(), tmp_path / "m.h5")
    harm(tmp_path / "m.h5")
    with pytest.raises(InputError, match=said):
        stored(Motion, tmp_path / "m.h5")


def test_a_write_that_fails_leaves_nothing(tmp_path):
    with pytest.raises(TypeError, match="set"):
        store(Pulled(np.zeros(3), {1.0}), tmp_path / "half.h5")
    assert list(tmp_path.iterdir()) == []
