"""Colours, and files that repeat byte for byte."""

import matplotlib
from matplotlib.figure import Figure

from palpate.report import style


def figure():
    with matplotlib.rc_context(style.STYLE):
        drawn = Figure(layout="constrained")
        axis = drawn.subplots()
        axis.plot([1, 2], [3, 5], label="a")
        axis.fill_between([1, 2], [3, 5], hatch="/")
        axis.legend()
    return drawn


def test_saved_files_repeat_byte_for_byte_and_leave_nothing_behind(tmp_path):
    style.save(figure(), tmp_path / "a.b")
    style.save(figure(), tmp_path / "again" / "c")
    for suffix in ("png", "svg"):
        assert (tmp_path / f"a.b.{suffix}").read_bytes() == (tmp_path / "again" / f"c.{suffix}").read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.b.png", "a.b.svg", "again"]
