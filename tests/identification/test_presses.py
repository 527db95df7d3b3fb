"""Files of presses: what is read, and what is refused in one sentence."""

import numpy as np
import pandas as pd
import pytest

from palpate.effects.instrument import SPHERE, Instrument
from palpate.errors import InputError
from palpate.identification.presses import doubts, join, read_presses

BALL = Instrument(SPHERE, 0.004)
DEPTH = np.linspace(0.0, 0.002, 6)


def table(presses=("a", "b"), **more):
    """Presses of tissue of 3 kPa, at places 10 mm apart."""
    force = 16.0 / 9.0 * 3000.0 * np.sqrt(0.004) * DEPTH**1.5
    parts = [
        pd.DataFrame({"press": name, "x_m": 0.01 * k, "y_m": 0.0, "z_m": 0.0, "depth_m": DEPTH, "force_n": force})
        for k, name in enumerate(presses)
    ]
    return pd.concat(parts, ignore_index=True).assign(**more)


def read(rows, tmp_path, *more, instrument=BALL, **options):
    rows.to_csv(tmp_path / "presses.csv", index=False)
    return read_presses(tmp_path / "presses.csv", instrument, *more, **options)


def test_what_is_written_is_read(tmp_path):
    rows = table(time_s=np.tile(np.arange(6.0), 2), normal_x=0.0, normal_y=0.0, normal_z=2.0, thickness_m=0.02)
    first, second = read(rows, tmp_path).presses
    assert (first.name, first.place, first.session, first.thickness_m) == ("a", "a", "", 0.02)
    assert second.at_m == pytest.approx([0.01, 0.0, 0.0]) and second.direction == pytest.approx([0.0, 0.0, -1.0])
    assert np.allclose(second.force_n, rows["force_n"][6:]) and np.allclose(first.time_s, np.arange(6.0))


def test_columns_of_other_names_are_joined_and_names_are_taken_apart(tmp_path):
    rows = table().rename(columns={"force_n": "f"}).assign(day="7", cut=["x"] * 6 + ["y"] * 6)
    columns = {"press": ["day", "cut", "press"], "force_n": "f"}
    found = read(rows, tmp_path, columns, r"(?P<session>\d) (?P<specimen>\w)").presses
    assert [(one.name, one.session, one.specimen) for one in found] == [("7 x a", "7", "X"), ("7 y b", "7", "Y")]
    assert [one.name for one in read(rows, tmp_path, columns, leave_out=["7 x a"]).presses] == ["7 y b"]


def test_presses_at_one_place_are_repeats(tmp_path):
    places = [one.place for one in read(table("abc").assign(x_m=[0.0] * 12 + [0.1] * 6), tmp_path).presses]
    assert places == ["a", "a", "c"]


def cell(column, row, value):
    def change(rows):
        rows[column] = rows[column].astype(object)
        rows.loc[row, column] = value
        return rows

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda rows: rows.drop(columns="force_n"), r"presses\.csv lacks the column force_n"),
        (lambda rows: rows.rename(columns={"depth_m": "depth_mm"}), "has depth_mm and lacks depth_m; convert it"),
        (lambda rows: rows.drop(columns="z_m"), "has x_m and not all of x_m, y_m, z_m"),
        (cell("force_n", 3, None), "row 5: force_n is empty, which is no number"),
        (cell("force_n", 3, "0,1"), "row 5: force_n is 0,1, which is no number"),
        (cell("x_m", slice(6, 12), None), r"row 8: x_m is empty, and other rows have it; .* \(1 of 2 lack some\)"),
        (cell("depth_m", 4, 0.0003), r"row 6: depth_m falls from 0\.0012 to 0\.0003 m in the press a"),
        (lambda rows: rows.assign(time_s=[0, 1, 1, 2, 3, 4] * 2), "row 4: time_s of the press a goes from 1 to 1 s"),
        (lambda rows: rows.assign(press=["a", "b"] * 6), "the press a stands above already"),
        (lambda rows: rows.assign(press="a"), "row 8: x_m of the press a differs"),
        (lambda rows: rows.drop(index=[1, 2]), "the press a has 4 points, fewer than 5"),
        (lambda rows: rows.assign(depth_m=1e3 * rows["depth_m"]), "a depth_m of 2 m, deeper than any organ"),
        (lambda rows: rows.assign(depth_m=25 * rows["depth_m"]), "12.5 radii of the instrument"),
        (lambda rows: rows.assign(depth_m=-rows["depth_m"]), "the press a is nowhere deeper than 0 m"),
        (lambda rows: rows.assign(force_n=1e5 * rows["force_n"]), r"a modulus of 3e\+08 Pa, of no soft tissue"),
        (lambda rows: rows.assign(force_n=-rows["force_n"]), "force_n falls with depth in most presses"),
        (cell("force_n", 0, -0.5), "the press a has a force_n of -0.5 N"),
        (lambda rows: rows.iloc[:0], "has no rows"),
    ],
)
def test_faults_are_named(change, message, tmp_path):
    with pytest.raises(InputError, match=message):
        read(change(table()), tmp_path)


def test_a_ball_is_smaller_than_what_it_presses(tmp_path):
    with pytest.raises(InputError, match=r"the instrument is 0\.008 m wide, and what it presses 0\.005 m"):
        read(table(), tmp_path, size_m=0.005)
    with pytest.raises(InputError, match=r"a depth_m of 0\.002 m, and what it presses is 0\.001 m thick"):
        read(table(), tmp_path, instrument=Instrument(SPHERE, 0.0004), size_m=0.001)


def test_grams_are_refused_by_the_name_of_the_column_and_doubted_by_values(tmp_path):
    """Forces a hundred times as large are those of cartilage: no value says that they are grams."""
    grams = table().assign(force_n=102 * table()["force_n"])
    assert not list(doubts(read(table(), tmp_path)))
    (doubt,) = doubts(read(grams, tmp_path))
    assert "3.1e+05 Pa, stiffer than the 100000 Pa that organs reach" in doubt
    with pytest.raises(InputError, match="has force_g and lacks force_n; convert it to newtons"):
        read(grams.rename(columns={"force_n": "force_g"}), tmp_path)


def test_files_are_joined_unless_names_repeat(tmp_path):
    one, other = read(table(), tmp_path), read(table("cd"), tmp_path)
    assert [press.name for press in join([one, other]).presses] == ["a", "b", "c", "d"]
    with pytest.raises(InputError, match="both have a press a; rename one"):
        join([one, one])


def test_presses_of_nothing_are_doubted(tmp_path):
    rows = table("abc")
    rows.loc[:5, "force_n"] = 0.001
    (doubt,) = doubts(read(rows, tmp_path))
    assert "does not rise with depth in 1 of 3 presses (a)" in doubt
