"""The page on which a body is pressed joins the errors of contact modes where they answer, and only there."""

from html import escape

from palpate.press.page.page import PressModel, press_document
from palpate.press.portable.file import FOUR_ERRORS


def test_a_page_on_which_contact_modes_answer_joins_their_errors():
    modes = PressModel("contact_modes", "contact modes", b"file")
    coarse = PressModel("coarse", "linear, coarse mesh", b"file", kind="coarse")
    joined = escape(" ".join(FOUR_ERRORS))
    assert press_document([modes, coarse]).count(joined) == 1 and joined not in press_document([coarse])
