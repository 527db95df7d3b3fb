"""Name models, methods and weights in plain words, as sentences and headings of the report need them."""

import re

from palpate.report.model_looks import look
from palpate.report.style import WEIGHTS

_RAW = re.compile(r"\b[a-z0-9]+(?:_[a-z0-9]+)+\b(?!=)")


def plain(text: str) -> str:
    """Replace raw names in ``text``, such as fem_fine, by their words; names of settings (``step_s=``) stay."""
    return _RAW.sub(lambda found: named(found[0]), text)


def named(name: str) -> str:
    """Return the words for a model, a method or weights; for anything else its name without underscores."""
    return WEIGHTS[name][0] if name in WEIGHTS else look(name).label
