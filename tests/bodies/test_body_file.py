from dataclasses import replace

import h5py
import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.body_file import load, save
from palpate.bodies.box import sheet
from palpate.bodies.refinement import finer
from palpate.bodies.supports import Bed
from palpate.errors import InputError


@pytest.fixture
def stored(cube, material, tmp_path):
    body = nest("cube", cube, 2, np.arange(4), material)
    save(body, tmp_path / "body.h5")
    return body, tmp_path / "body.h5"


def test_round_trip(stored):
    body, path = stored
    found = load(path)
    assert (found.name, found.material, len(found.levels)) == ("cube", body.material, 3)
    for mine, theirs in zip(body.levels, found.levels, strict=True):
        assert np.array_equal(mine.nodes, theirs.nodes)
        assert np.array_equal(mine.tetrahedra, theirs.tetrahedra)
    assert all(map(np.array_equal, body.anchors, found.anchors))
    assert abs(body.prolongation - found.prolongation).max() == 0


@pytest.mark.parametrize("facing", [None, np.array([0.0, 0.0, -1.0])])
def test_a_bed_comes_back_and_finer_keeps_it(cube, material, tmp_path, facing):
    bed = Bed(np.array([0.5, 0.5, 0.0]), 0.8, 1e5, facing)
    save(nest("cube", cube, 1, np.empty(0, dtype=int), material, bed=bed), tmp_path / "bedded.h5")
    body = load(tmp_path / "bedded.h5")
    for found in (body.bed, finer(body).bed):
        assert np.array_equal(found.center_m, bed.center_m)
        assert (found.radius_m, found.stiffness_n_m3) == (0.8, 1e5)
        assert found.facing is None if facing is None else np.array_equal(found.facing, facing)
    assert [len(held) for held in body.anchors] == [0, 0] and body.anchors[0].dtype.kind == "i"


def test_densities_of_a_ct_come_back_and_finer_keeps_them(cube, material, tmp_path):
    body = nest("cube", cube, 1, np.arange(4), material)
    body = replace(body, densities=[1000.0 + level.nodes[:, 0] for level in body.levels])
    save(body, tmp_path / "weighed.h5")
    found = load(tmp_path / "weighed.h5")
    assert all(map(np.array_equal, body.densities, found.densities))
    assert finer(found).densities[2] == pytest.approx(1000.0 + finer(body).fine.nodes[:, 0])
    assert len(found.up_to(0).densities) == len(found.up_to(0).levels) == len(found.up_to(0).anchors) == 1
    with h5py.File(tmp_path / "weighed.h5", "a") as file:
        del file["level_1/densities_kg_m3"]
        file["level_1/densities_kg_m3"] = np.ones(3)
    with pytest.raises(InputError, match="densities_kg_m3 do not fit the nodes"):
        load(tmp_path / "weighed.h5")


def test_a_sheet_comes_back(material, tmp_path):
    cloth = sheet([0.3, 0.2], [2, 2], 0.001)
    save(nest("cloth", cloth, 0, np.array([0]), material), tmp_path / "cloth.h5")
    body = load(tmp_path / "cloth.h5")
    assert np.array_equal(body.coarse.nodes, cloth.nodes)
    assert np.array_equal(body.coarse.triangles, cloth.triangles)
    assert body.coarse.thickness_m == 0.001
    assert (body.anchors[0].tolist(), body.prolongations) == ([0], [])


def test_same_body_gives_the_same_bytes(stored, tmp_path):
    body, path = stored
    save(body, tmp_path / "again.h5")
    assert (tmp_path / "again.h5").read_bytes() == path.read_bytes()


def test_a_failed_write_leaves_nothing(stored, tmp_path):
    body, path = stored
    body.levels.append(None)
    with pytest.raises(ValueError, match="zip"):
        save(body, tmp_path / "half.h5")
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_another_version_is_refused(stored):
    _, path = stored
    with h5py.File(path, "a") as file:
        file.attrs["version"] = 0
    with pytest.raises(InputError, match="version is not 6"):
        load(path)


def test_nan_is_refused_by_name(stored):
    _, path = stored
    with h5py.File(path, "a") as file:
        file["level_1/nodes"][3, 0] = np.nan
    with pytest.raises(InputError, match="/level_1/nodes"):
        load(path)


def test_a_cut_file_is_refused(stored):
    _, path = stored
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(InputError, match=r"body\.h5 is damaged \(.*truncated.*\); delete it and type make\.$"):
        load(path)
    with pytest.raises(InputError, match=r"body\.h5 is missing; type make, which makes it\.$"):
        load(path.parent / "missing" / "body.h5")
