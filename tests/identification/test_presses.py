"""Files of presses: what is read, and what is refused in one sentence."""

import re

import numpy as np
import pandas as pd
import pytest

from palpate.effects.instrument import SPHERE, Instrument
from palpate.errors import InputError
from palpate.identification.presses import doubts, read_presses

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


def written(rng, rows):
    """Return bytes of the rows in an encoding that is drawn, and a part of the sentence if it has to be refused."""
    separator, decimal, quote = rng.choice([",", ";", "\t"]), rng.choice([".", ","]), rng.choice(["", '"'])
    names = {"depth_m": ["depth_m", "Depth (m)", "DEPTH_M", "depth[m]"], "press": ["press", "Press"]}
    names |= {"force_n": ["force_n", "Force_N", "force / N"], "time_s": ["time_s", "Time_s", "time (s)"]}
    names = {name: rng.choice(of) for name, of in names.items()}
    wrong = rng.choice(["", "depth [mm]", "Force (mN)", "time_ms"]) if rng.random() < 0.3 else ""
    names |= {name: wrong for name in names if wrong and wrong.lower().startswith(name[:4])}
    header = [*rng.permutation(list(names)), "Prüfer µ"]
    if twice := rng.random() < 0.1 and not wrong:
        header.append("force_n")
    lines = [[names.get(name, name) for name in header]]
    lines += [[str(row.get(name, "Müller")).replace(".", decimal) for name in header] for _, row in rows.iterrows()]
    ends = separator if rng.random() < 0.3 else ""
    text = "\r\n".join(separator.join(quote + cell + quote for cell in line) + ends for line in lines)
    raw = f"{text}\r\n{ends}".encode(rng.choice(["utf-8", "utf-8-sig", "latin-1", "utf-16"]))
    if separator == decimal and not quote:
        return raw, "where decimals have commas"
    return raw, f"has {wrong} and lacks" if wrong else "two columns for force_n" * twice


@pytest.mark.parametrize("seed", range(12))
def test_presses_are_the_same_in_every_encoding_or_refused_in_a_sentence(seed, tmp_path):
    rows = table(time_s=np.tile(np.arange(6.0), 2)).round(7)
    raw, refused = written(np.random.default_rng(seed), rows)
    (tmp_path / "presses.csv").write_bytes(raw)
    if refused:
        with pytest.raises(InputError, match=r"^.*presses\.csv.*[^\n]*$") as error:
            read_presses(tmp_path / "presses.csv", BALL)
        assert refused in str(error.value)
        return
    found = read_presses(tmp_path / "presses.csv", BALL).presses
    for press, number in zip(found, (0, 6), strict=True):
        for name in ("depth_m", "force_n", "time_s"):
            assert (getattr(press, name) == rows[name][number : number + 6]).all()


@pytest.mark.parametrize("column", ["thickness_mm", "Time (ms)", "z"])
def test_columns_that_look_like_others_are_refused(column, tmp_path):
    with pytest.raises(InputError, match=r"and lacks .*; convert it to"):
        read(table().drop(columns=["x_m", "y_m", "z_m"]).assign(**{column: 1.0}), tmp_path)


@pytest.mark.parametrize(("zero", "slope", "pull"), [(0.0, 0.0, 0.0), (0.015, -5.0, 0.0), (-0.02, 5.0, 0.004)])
def test_the_line_before_contact_is_subtracted(zero, slope, pull, tmp_path):
    """Of Hertz presses of 4 kPa, whose pull by adhesion of 5 % begins with contact."""
    rng, depth = np.random.default_rng(0), np.linspace(-1e-3, 3e-3, 41)
    clean = 16.0 / 9.0 * 4000.0 * np.sqrt(0.004) * np.clip(depth, 0.0, None) ** 1.5 - pull * (depth > 0.0)
    rows = pd.concat([pd.DataFrame({"press": name, "depth_m": depth, "force_n": clean}) for name in "abcdef"])
    rows["force_n"] += zero + slope * rows["depth_m"] + 2e-4 * rng.normal(size=len(rows))
    records = read(rows, tmp_path)
    found = np.mean([press.force_n for press in records.presses], axis=0)
    assert found == pytest.approx(clean, abs=9e-4) and 0.0 < records.force_error < 0.02
    assert any("tissue that sticks" in doubt for doubt in doubts(records)) == (pull > 0.0)
    told = re.search(r"(\S+) mN at depth 0 and (\S+) mN/mm", records.found[0])
    assert [float(each) for each in told.groups()] == pytest.approx([1e3 * zero, slope], abs=0.3)
    some = read(rows[rows["press"].isin(["a", "b"]) | (rows["depth_m"] >= 0.0)], tmp_path)  # the others have no rows
    assert some.presses[5].force_n == pytest.approx(clean[depth >= 0.0], abs=9e-4)


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
        (lambda rows: rows.drop(columns="z_m"), "has x_m and not all of x_m, y_m, z_m"),
        (cell("force_n", 3, None), "row 5: force_n is empty, which is no number"),
        (cell("x_m", slice(6, 12), None), r"row 8: x_m is empty, and other rows have it; .* \(1 of 2 lack some\)"),
        (cell("depth_m", 4, 0.0003), r"row 6: depth_m falls from 0\.0012 to 0\.0003 m in the press a"),
        (lambda rows: rows.assign(time_s=[0, 1, 1, 2, 3, 4] * 2), "row 4: time_s of the press a goes from 1 to 1 s"),
        (lambda rows: rows.assign(press=["a", "b"] * 6), "the press a stands above already"),
        (lambda rows: rows.drop(index=[1, 2]), "the press a has 4 points, fewer than 5"),
        (lambda rows: rows.assign(depth_m=1e3 * rows["depth_m"]), "a depth_m of 2 m, deeper than any organ"),
        (lambda rows: rows.assign(depth_m=-rows["depth_m"]), "the press a is nowhere deeper than 0 m"),
        (lambda rows: rows.assign(force_n=1e5 * rows["force_n"]), r"a modulus of 3e\+08 Pa, of no soft tissue"),
        (lambda rows: rows.assign(force_n=-rows["force_n"]), "force_n falls with depth in most presses"),
        (cell("force_n", 0, -0.5), "the press a has a force_n of -0.5 N"),
    ],
)
def test_faults_are_named(change, message, tmp_path):
    with pytest.raises(InputError, match=message):
        read(change(table()), tmp_path)


def test_a_ball_may_be_wider_than_a_slab_and_goes_no_deeper_than_it(tmp_path):
    assert read(table(), tmp_path, size_m=0.005).presses
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


@pytest.mark.parametrize("name", ["Load_lbf", "Load (mN) raw", "stress_kPa"])
def test_columns_that_are_named_by_hand_have_no_other_unit_in_their_names(name, tmp_path):
    rows = table().rename(columns={"force_n": name})
    with pytest.raises(InputError, match="whose name has another unit; convert it to newtons"):
        read(rows, tmp_path, {"force_n": name})
    for own in ("Load (N) raw", "F_z", "Newton"):
        assert read(rows.rename(columns={name: own}), tmp_path, {"force_n": own}).presses


def test_a_press_in_another_unit_than_the_others_is_doubted(tmp_path):
    rows = table("abc")
    rows.loc[:5, "force_n"] *= 102.0
    (doubt,) = doubts(read(rows, tmp_path))
    assert ": a of 3 presses are 90 times as stiff or soft" in doubt
