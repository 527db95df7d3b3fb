"""The figure of loads that nothing was prepared for has a panel for each kind, and names who refuses."""

import numpy as np
from fixtures.trade_off import any_load as made_up

from palpate.studies.tradeoff.figures import advice
from palpate.studies.tradeoff.general_loads import KINDS


def test_every_kind_has_a_panel_with_its_errors_and_refusals():
    table = made_up()
    axes = advice.draw_any_load(table).axes
    assert [axis.get_title("left") for axis in axes[:5]] == [*KINDS, "depth: the force"] and len(axes) == 10
    for axis, kind in zip(axes[:4], KINDS, strict=True):
        rows = table[(table["scene"] == "cylinder_large") & (table["kind"] == kind) & (table["refused"] == 0)]
        drawn = np.sort(np.concatenate([line.get_ydata() for line in axis.lines]))
        assert np.allclose(drawn, np.sort(100 * rows["rmse_of_peak"]))
    named = ["" if not axis.texts else axis.texts[0].get_text() for axis in axes[:4]]
    assert named == ["", "refused by\nlinear fine FEM", "refused by\nsprings", "refused by\nsprings"]
    forces = table[(table["scene"] == "liver_large") & table["force_error"].notna()]["force_error"]
    assert np.allclose(np.sort(np.concatenate([line.get_ydata() for line in axes[9].lines])), np.sort(100 * forces))


def test_a_setting_that_failed_on_some_is_hollow():
    table = made_up()
    first = (table["model"] == "fem_p2") & (table["kind"] == "prepared")
    table.loc[first & (table["setting"] == "level=0, start=rest"), "failures"] = 1
    hollow = [line for line in advice.draw_any_load(table).axes[0].lines if line.get_markerfacecolor() == "white"]
    assert [list(line.get_xdata()) for line in hollow] == [[20.0]]
