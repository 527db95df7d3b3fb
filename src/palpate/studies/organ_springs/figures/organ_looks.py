"""Label, colour and marker of each model of an organ: its springs, however fitted, and their rivals."""

from dataclasses import dataclass

from palpate.errors import InputError
from palpate.report.spring_looks import FITS
from palpate.report.style import Look


@dataclass(frozen=True)
class OrganLook(Look):
    """A look with a ``short`` label, for axes."""

    short: str = ""


_SHORT = {
    "van_gelder": "Van Gelder",
    "lloyd": "Lloyd",
    "uniform": "one E",
    "genetic": "genetic",
    "cma_es": "CMA-ES",
    "gradient": "gradient",
}
LOOKS = {
    "zero": OrganLook("no motion", "#9a9a9a", "x", "none"),
    **{name: OrganLook(FITS[name].label, FITS[name].colour, FITS[name].marker, _SHORT[name]) for name in _SHORT},
    "coarse_fem": OrganLook("coarse finite elements", "#222222", "^", "coarse FEM"),
    "shape_matching": OrganLook("shape matching", "#56b4e9", "h", "shapes"),
}
"""Every model that may occur in the table."""


def look(model: str) -> OrganLook:
    """Look up the look of a model; raises InputError for an unknown one."""
    try:
        return LOOKS[model]
    except KeyError:
        raise InputError(f"model {model} has no colour: give it one in palpate/studies/organ_springs/figures") from None
