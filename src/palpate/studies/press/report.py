"""Name what a reader can press in the page."""

from typing import Any

from palpate.press.page.page import TITLES
from palpate.press.portable.file import FOUR_ERRORS
from palpate.report.report import Report


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names beside its table."""
    return {"titles": TITLES, "errors": FOUR_ERRORS}
