"""Name scenes, models and methods in plain words, as sentences and headings of the report need them."""

import re

from palpate.figures.model_looks import look
from palpate.figures.style import WEIGHTS

_RAW = re.compile(r"\b[a-z0-9]+(?:_[a-z0-9]+)+\b(?!=)")


def plain(text: str) -> str:
    """Replace raw names in ``text``, such as fem_fine, by their words; names of settings (``step_s=``) stay."""
    return _RAW.sub(lambda found: named(found[0]), text)


def named(name: str) -> str:
    """Return the words for a model, a method or weights; for anything else its name without underscores."""
    return WEIGHTS[name][0] if name in WEIGHTS else look(name).label


def spaced(name: str) -> str:
    """Return the name of a scene, a body or an effect without underscores."""
    return name.replace("_", " ")


def listed(parts: list[str]) -> str:
    """Join phrases as a sentence does: "a, b and c"."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def capital(sentence: str) -> str:
    """Begin a sentence with a capital letter."""
    return sentence[:1].upper() + sentence[1:]
