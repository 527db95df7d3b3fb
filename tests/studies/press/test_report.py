"""The part of the report to press a body has its page, its table and its numbers."""

import pandas as pd
from fixtures.material import material

from palpate.report.tables import columns
from palpate.report.template import Html


def table(**changes):
    row = dict.fromkeys(columns("press"), 1.0) | {"body": "liver", "model": "contact_modes", "contacts": 12}
    row |= {"samples": 6, "rmse_of_peak": 0.004, "error_of_peak": 0.01, "online_median_s": 0.0021, "doubted": 1}
    return pd.DataFrame([row | changes, row | {"model": "coarse", "rmse_of_peak": 0.1} | changes])


def test_each_body_has_a_section(tmp_path):
    report = material("press", {"press": table()})
    report.figures = tmp_path
    (tmp_path / "press_liver.section").write_text('<figure class="press"></figure>')
    ((key, title, content),) = report.part("press", Html).sections
    assert (key, title) == ("press_liver", "Liver")
    assert content.startswith('<figure class="press">')
    assert "on 6 presses" in content and "linear, coarse mesh" in content
