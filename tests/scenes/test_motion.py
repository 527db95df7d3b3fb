"""A motion as ParaView reads it."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import pyvista

from palpate.scenes.motion import Motion, write_series


@pytest.fixture
def motion(beam):
    """Five frames of the coarse beam, inner nodes included, stretched ever more."""
    mesh, times = beam.coarse, np.array([0.0, 0.1, 0.25, 0.3, 1.0 / 3.0])
    positions = mesh.nodes * (1 + times)[:, None, None]
    cells = mesh.triangles, mesh.tetrahedra
    return Motion("stretch", times, positions, positions[0], *cells, beam.anchors[0], pd.DataFrame({"time_s": times}))


def test_reads_back_what_was_moved(motion, tmp_path):
    reader = pyvista.get_reader(str(write_series(motion, tmp_path / "new" / "series")))
    assert reader.time_values == motion.times.tolist()
    for frame, time in enumerate(motion.times):
        reader.set_active_time_value(time)
        surface = reader.read()[0]
        np.testing.assert_array_equal(surface.points, motion.positions[frame])
        np.testing.assert_array_equal(surface.cells_dict[pyvista.CellType.TETRA], motion.tetrahedra)
        moved = motion.positions[frame] - motion.positions[0]
        np.testing.assert_array_equal(surface.point_data["displacement_m"], moved)
        np.testing.assert_array_equal(np.flatnonzero(surface.point_data["held"]), motion.held)


def test_two_writings_are_the_same_bytes_and_a_shorter_one_leaves_nothing_behind(motion, tmp_path):
    for name in "ab":
        write_series(motion, tmp_path / name)
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert names == ["stretch.pvd", *(f"stretch_{frame:04d}.vtu" for frame in range(5))]
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    (tmp_path / "a" / "stretch_up_0004.vtu").write_text("of another scene")
    write_series(replace(motion, times=motion.times[:2], positions=motion.positions[:2]), tmp_path / "a")
    left = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert left == ["stretch.pvd", "stretch_0000.vtu", "stretch_0001.vtu", "stretch_up_0004.vtu"]
