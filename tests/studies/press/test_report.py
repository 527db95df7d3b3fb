"""The part of the report to press a body has its page, its table and its sentences."""

import pandas as pd
from fixtures.material import numbers

from palpate.press.portable.file import FOUR_ERRORS
from palpate.report.tables import columns
from palpate.studies.press import report as press


def table(**changes):
    row = dict.fromkeys(columns("press"), 1.0) | {"body": "liver", "model": "contact_modes", "contacts": 12}
    row |= {"samples": 6, "rmse_of_peak": 0.004, "online_median_s": 0.0021, "doubted": 1}
    return pd.DataFrame([row | changes, row | {"model": "coarse", "rmse_of_peak": 0.1} | changes])


def test_captions_say_what_answers():
    said = numbers("press", {"press": table()})
    assert said["press_worth"] == "liver: 0.4 % of the peak wrong, in 2.1 ms in Python"
    assert said["press_errors"] == " ".join(FOUR_ERRORS)
    assert said["press_doubted"] == "liver: 1 of 6" and said["press_contacts"] == "liver: 12"


def test_without_truths_no_error_is_said():
    said = numbers("press", {"press": table(samples=0, rmse_of_peak=float("nan"))})
    assert said["press_worth"] == "liver: 2.1 ms in Python" and said["press_doubted"] == "liver: none known"


class Page:
    """What a part of the report asks for."""

    def __init__(self, figures):
        self.figures, self.tables = figures, {"press": table()}

    def note(self, name):
        return f"<p>{name}</p>"

    def folded(self, name):
        return f"<details>{name}</details>"


def test_each_body_has_a_section(tmp_path):
    (tmp_path / "press_liver.section").write_text('<figure class="press"></figure>')
    ((key, title, content),) = press.sections(Page(tmp_path))
    assert (key, title) == ("press_liver_section", "Liver")
    assert (
        content.startswith('<figure class="press">') and "on 6 presses" in content and "linear, coarse mesh" in content
    )
