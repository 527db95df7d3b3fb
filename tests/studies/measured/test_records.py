"""Files of markers: what is read, and what is refused in one sentence."""

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from palpate.errors import InputError
from palpate.studies.measured.records import fit_oscillation, read_record, register

MARKERS = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.05, 0.01], [0.02, 0.0, 0.08]])


def test_gaps_are_interpolated(tmp_path):
    times = np.arange(20) / 10
    table = pd.DataFrame({"time_s": times, "a_x_m": 2 * times, "a_y_m": 0.0, "a_z_m": 0.0, "other": "x"})
    table.loc[7, "a_x_m"] = None
    table.to_csv(tmp_path / "a.csv", index=False)
    _, places = read_record(tmp_path / "a.csv", ["a"])
    assert places[7, 0] == pytest.approx([1.4, 0.0, 0.0])


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"a_x_m": ["one", 1, 2, 3]}, "column a_x_m that is no number"),
        ({"time_s": [0.0, 0.2, 0.1, 0.3]}, "times that do not increase"),
        ({"a_y_m": [1.0, None, None, 1.0]}, "a_y_m is empty in 50% of the rows"),
        ({}, r"record\.csv lacks the column b_x_m"),
        (None, r"record\.csv is no table"),
    ],
)
def test_faults_are_named(tmp_path, columns, message):
    path, names = tmp_path / "record.csv", ["a"] if columns else ["a", "b"]
    if columns is not None:
        table = pd.DataFrame({"time_s": [0.0, 0.1, 0.2, 0.3], **{f"a_{axis}_m": [1.0] * 4 for axis in "xyz"}})
        table.assign(**columns).to_csv(path, index=False)
    with pytest.raises(InputError, match=message):
        read_record(path, names)


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


def made_up(t, hz=7.74, ratio=0.052, creep=6e-4, noise=0.0):
    omega = 2 * np.pi * hz
    swing = 5e-3 * np.exp(-ratio * omega * t) * np.cos(omega * np.sqrt(1 - ratio**2) * t + 0.3)
    return 6.5e-3 - creep * np.exp(-t / 0.55) + swing + np.random.default_rng(0).normal(0.0, noise, len(t))


@pytest.mark.parametrize(("hz", "ratio"), [(7.74, 0.052), (2.0, 0.2)])
def test_it_is_recovered(hz, ratio):
    t = np.arange(0.0, 4.0, 0.01)
    found = fit_oscillation(t, made_up(t, hz, ratio), "made up")
    assert found.frequency_hz == pytest.approx(hz, rel=1e-6) and found.damping_ratio == pytest.approx(ratio, rel=1e-6)
    before = np.exp(0.5 / hz / 0.55)  # it was let go half a swing before
    assert found.creep_m == pytest.approx(6e-4 * before, rel=1e-3) and found.creep_s == pytest.approx(0.55, rel=1e-3)


def test_noise_of_a_camera_and_a_gap_hardly_matter():
    t = np.arange(0.0, 4.0, 0.01)
    t = t[(t < 1.8) | (t > 3.0)]
    found = fit_oscillation(t, made_up(t, noise=1e-5), "made up")
    assert found.frequency_hz == pytest.approx(7.74, rel=1e-3) and found.damping_ratio == pytest.approx(0.052, rel=5e-3)


def test_free_swings_are_recovered_without_creep():
    t = np.arange(0.0, 1.0, 0.002)
    found = fit_oscillation(t, made_up(t, creep=0.0), "made up", creeps=False)
    assert found.damping_ratio == pytest.approx(0.052, rel=1e-3) and found.creep_m == 0.0


def test_what_does_not_swing_is_refused():
    t = np.arange(0.0, 2.0, 0.01)
    with pytest.raises(InputError, match="made up shows no damped oscillation after the release; set swings: false"):
        fit_oscillation(t, np.random.default_rng(0).normal(size=len(t)), "made up")
    with pytest.raises(InputError, match="made up has 5 rows after the release"):
        fit_oscillation(t[:5], t[:5], "made up")
