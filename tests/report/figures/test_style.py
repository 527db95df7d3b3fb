"""Colours, and files that repeat byte for byte."""

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from palpate.errors import InputError
from palpate.models.enrichment.paper_enrichment import WEIGHTS
from palpate.report import style
from palpate.scenes.effect_registry import EFFECTS

RIVALS = ["interpolation", "ridge_upsampling", "kernel_ridge_detail", "pod_rbf", "linear_fem", "detail_correction"]

# Machado, Oliveira, Fernandes 2009, severity 1, on linear RGB
DICHROMATS = {
    "protan": [
        [0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998],
    ],
    "deutan": [
        [0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881],
    ],
}  # fmt: skip


def seen(colour, matrix):
    """CIE L*a*b* of a colour as a dichromat sees it."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    linear = np.clip(np.array(matrix) @ linear, 0, 1)
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    t = np.array(to_xyz) @ linear / [0.9505, 1.0, 1.089]
    f = np.where(t > 0.008856, np.cbrt(t), 7.787 * t + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def test_every_method_has_its_own_look():
    names = [f"{f}_{w}" for f in style.FEATURES for w in style.WEIGHTS] + RIVALS
    looks = [style.look(name) for name in names]
    assert len({look.colour for look in looks}) == len(names)
    assert len({look.label for look in looks}) == len(names)


def test_kinds_of_weights_are_those_of_the_methods():
    assert set(WEIGHTS) == set(style.WEIGHTS)


@pytest.mark.parametrize("eye", DICHROMATS)
def test_the_main_methods_are_told_apart_by_dichromats(eye):
    main = [style.BASELINE, style.PAPERS, "framed_nonnegative_a", *RIVALS]
    lab = np.array([seen(style.look(m).colour, DICHROMATS[eye]) for m in main])
    distances = np.linalg.norm(lab[:, None] - lab[None], axis=2)[np.triu_indices(len(main), 1)]
    # or by their markers, where two colours come close
    markers = np.array([style.look(m).marker for m in main])
    same_marker = (markers[:, None] == markers[None])[np.triu_indices(len(main), 1)]
    assert distances[same_marker].min() > 15
    assert distances.min() > 4


def test_an_unknown_method_is_refused_by_name():
    with pytest.raises(InputError, match="magic"):
        style.look("magic")


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


def test_drawing_leaves_the_callers_settings_alone():
    before = {key: matplotlib.rcParams[key] for key in style.STYLE}
    inside = style.styled(lambda: matplotlib.rcParams["svg.hashsalt"])()
    assert inside == style.STYLE["svg.hashsalt"]
    assert {key: matplotlib.rcParams[key] for key in style.STYLE} == before


def test_every_effect_has_a_colour_and_one_of_the_users_own_always_the_same():
    assert set(EFFECTS) <= set(style.EFFECTS)
    assert style.effect_colour("wind") == style.effect_colour("wind")
    assert style.effect_colour("wind") not in style.EFFECTS.values()
