"""What halving the step changes is drawn over time, and frames that are left out are shaded."""

import pandas as pd

from palpate.report import style
from palpate.studies.dynamic import figures


def test_a_line_a_step_and_what_is_left_out_is_shaded(tmp_path):
    rows = [
        [f"scene_{number}", step, time, change, 0.01, number > 0 or time < 0.25]
        for number in range(5)
        for step, change in ((0.02, 0.04), (0.01, 0.02))
        for time in (0.1, 0.2, 0.3)
    ]
    columns = ["scene", "step_s", "time_s", "change_of_peak", "bound", "resolved"]
    figure = figures.draw_dynamic_reference(pd.DataFrame(rows, columns=columns))
    assert [axis.get_title("left") for axis in figure.axes] == [f"scene {number}" for number in range(5)]
    first, second = figure.axes[:2]
    assert [line.get_ydata()[0] for line in first.lines] == [4.0, 2.0, 1.0]
    assert len(first.patches) == 1 and not second.patches
    style.save(figure, tmp_path / "dynamic_reference")
