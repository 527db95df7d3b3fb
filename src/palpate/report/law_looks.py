"""Label and colour of each law, and of each other change of a body, in figures and tables."""

from pathlib import PurePath

from palpate.studies.law.compare_laws import OWN, POISSON, REGIONS

LAWS = {
    "corotational": ("corotational", "#009e73"),
    "stable_neo_hookean": ("stable neo-Hookean", "#56b4e9"),
    "neo_hookean": ("neo-Hookean", "#0072b2"),
    "st_venant_kirchhoff": ("St. Venant–Kirchhoff", "#d55e00"),
}
POISSONS = ("#cc79a7", "#7a3b63", "#b8578f", "#e3b1cd")
"""Colours of the other Poisson's ratios, in the order of the table."""
UNIFORM = ("without its regions", "#e6b400")
OTHER = "#8b0000"
"""Of a law of the user's own."""


def law_label(law: str) -> str:
    """Name a law; one of the user's own by its file."""
    return LAWS[law][0] if law in LAWS else PurePath(law).stem.replace("_", " ")


def label(changed: str, law: str, poisson: float) -> str:
    """Name a change of a body: "neo-Hookean", "ν = 0.45"; of the body as it is described its law and ν."""
    if changed == OWN:
        return f"{law_label(law)}, ν = {poisson:g}"
    return {POISSON: f"ν = {poisson:g}", REGIONS: UNIFORM[0]}.get(changed, law_label(law))


def colour(changed: str, law: str, number: int) -> str:
    """Return the colour of a change; ``number`` is the place of a Poisson's ratio among those of the table."""
    of_law = LAWS[law][1] if law in LAWS else OTHER
    return {POISSON: POISSONS[number % len(POISSONS)], REGIONS: UNIFORM[1]}.get(changed, of_law)
