"""Files of markers: what is read, and what is refused in one sentence."""

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from palpate.errors import InputError
from palpate.studies.measured.records import read_record, register

MARKERS = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.05, 0.01], [0.02, 0.0, 0.08]])


@pytest.fixture
def file(tmp_path):
    def write(**columns):
        table = pd.DataFrame({"time_s": [0.0, 0.1, 0.2, 0.3], **{f"a_{axis}_m": [1.0] * 4 for axis in "xyz"}})
        path = tmp_path / "record.csv"
        table.assign(**columns).to_csv(path, index=False)
        return path

    return write


def test_gaps_are_interpolated(tmp_path):
    times = np.arange(20) / 10
    table = pd.DataFrame({"time_s": times, "a_x_m": 2 * times, "a_y_m": 0.0, "a_z_m": 0.0, "other": "x"})
    table.loc[7, "a_x_m"] = None
    table.to_csv(tmp_path / "a.csv", index=False)
    record = read_record(tmp_path / "a.csv", ["a"])
    assert record.places[7, 0] == pytest.approx([1.4, 0.0, 0.0])
    assert record.mean(0.0, 0.2)[0, 0] == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"a_x_m": ["one", 1, 2, 3]}, "column a_x_m that is no number"),
        ({"time_s": [0.0, 0.2, 0.1, 0.3]}, "times that do not increase"),
        ({"a_y_m": [1.0, None, None, 1.0]}, "a_y_m is empty in 50% of the rows"),
    ],
)
def test_faults_are_named(file, columns, message):
    with pytest.raises(InputError, match=message):
        read_record(file(**columns), ["a"])


def test_a_missing_marker_or_file_is_named(file, tmp_path):
    with pytest.raises(InputError, match=r"record\.csv lacks the column b_x_m"):
        read_record(file(), ["a", "b"])
    with pytest.raises(InputError, match=r"none\.csv is no table"):
        read_record(tmp_path / "none.csv", ["a"])


def test_a_frame_is_found_again():
    turn, shift = Rotation.from_euler("xyz", [0.3, -1.2, 2.0]).as_matrix(), np.array([0.1, -0.2, 0.3])
    found = register((MARKERS - shift) @ turn, MARKERS, "record")
    assert found.rotation == pytest.approx(turn) and found.shift == pytest.approx(shift)
    assert found.misfit_m < 1e-15


@pytest.mark.parametrize("wrong", [1000 * MARKERS, MARKERS * [1, 1, -1], MARKERS[[1, 0, 2, 3]]])
def test_other_units_mirrored_frames_and_confused_markers_are_refused(wrong):
    with pytest.raises(InputError, match=r"record: the markers before the release are .* m \(RMS\) from their places"):
        register(wrong, MARKERS, "record")


def test_markers_on_a_line_are_refused():
    line = np.outer([0.0, 1.0, 2.0], [1.0, 2.0, 3.0])
    with pytest.raises(InputError, match="needs three markers that are not on one line"):
        register(line, line, "record")
