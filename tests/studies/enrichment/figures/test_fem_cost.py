"""Times of the fine simulation are drawn over the peak displacement."""

import numpy as np

from palpate.report import style
from palpate.studies.enrichment.figures import charts


def test_times_are_drawn_over_peaks_in_millimetres(results, tmp_path):
    figure = charts.draw_fem_cost(results["fem_cost"], results["sample_peaks"])
    np.testing.assert_allclose(figure.axes[0].lines[0].get_xdata(), [4, 5, 6, 7])
    style.save(figure, tmp_path / "fem_cost")
