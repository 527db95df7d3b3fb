"""Give every model of the trade-off its name, colour and marker, the user's own included."""

import re
from dataclasses import dataclass
from pathlib import PurePath

from palpate.bodies.material import stiffening_of
from palpate.report.words import spaced


@dataclass(frozen=True)
class Look:
    """Label, colour and marker of a method in every figure and table."""

    label: str
    colour: str
    marker: str


WEIGHTS = {
    "signed": ("signed inverse", "o"),
    "nonnegative_a": ("non-negative (a)", "s"),
    "nonnegative_b": ("non-negative (b)", "D"),
    "clipped": ("clipped inverse", "^"),
}
"""Label and marker of each way of computing the blend weights."""

# Hues after Okabe and Ito (2008), distinguishable with any colour vision; within one hue lightness and marker vary
FEATURES = {
    "unordered": ("unordered", ("#003f66", "#0072b2", "#3f9bd1", "#8cc4e6")),
    "ordered": ("contact-ordered", ("#8a3c00", "#d55e00", "#ee8742", "#f7b78a")),
    "framed": ("contact-ordered, own frame", ("#7a3b63", "#b8578f", "#cc79a7", "#e3b1cd")),
}
"""Feature vectors of the regressors: label and one shade for each of WEIGHTS."""

METHODS = {
    f"{features}_{weights}": Look(f"{name}, {how}", shade, marker)
    for features, (name, shades) in FEATURES.items()
    for (weights, (how, marker)), shade in zip(WEIGHTS.items(), shades, strict=True)
} | {
    "interpolation": Look("linear interpolation", "#7d7d7d", "X"),
    "ridge_upsampling": Look("ridge upsampling", "#e6b400", "v"),
    "kernel_ridge_detail": Look("kernel ridge on detail", "#56b4e9", "P"),
    "pod_rbf": Look("POD + RBF", "#6b4f2a", "p"),
    "linear_fem": Look("linear fine FEM", "#3b3b8f", "h"),
    "detail_correction_unturned": Look("corrected coarse FEM, not turned", "#b5e3d2", "d"),
    "detail_correction_untaught": Look("corrected coarse FEM, nothing learnt", "#66c2a5", "d"),
    "detail_correction": Look("corrected coarse FEM", "#009e73", "*"),
    "live_all_in": Look("corrected coarse FEM, live all-in", "#00664a", "*"),
    "coarse_fem": Look("coarse FEM", "#bdbdbd", "<"),
    "fine_fem": Look("fine FEM", "#111111", "8"),
}
"""Every method of paper 1 and its rivals that may occur in a table, in table order."""

FITS = {
    "uniform": Look("one E for all nodes", "#7d7d7d", "X"),
    "van_gelder": Look("Van Gelder", "#6b4f2a", "P"),
    "lloyd": Look("Lloyd", "#e6b400", "v"),
    "genetic": Look("genetic algorithm (the paper)", "#d55e00", "o"),
    "cma_es": Look("CMA-ES", "#0072b2", "s"),
    "gradient": Look("gradient by the adjoint", "#009e73", "*"),
    "gradient_smooth": Look("gradient, regularised moduli", "#cc79a7", "D"),
    "gradient_all": Look("gradient, fitted to all presses", "#66c2a5", "*"),
}
"""Every method for spring parameters, in table order."""
DASHES = {False: "--", True: "-"}
"""Line styles without and with the volume force."""
FORCES = {False: "springs alone", True: "springs and volume force"}

OPERATIONS = {
    "sorting": "sorting by distance",
    "building_phi": "building Φ",
    "building_a": "building A = Φ⁻¹",
    "building_w": "building w",
}
"""The steps of the paper's table 3."""

PAPERS = "ordered_nonnegative_a"
"""The method the paper proposes: contact-ordered features, its nearest non-negative matrix."""

BASELINE = "unordered_nonnegative_a"
"""The method the paper compares with: all coarse displacements in mesh order."""

ALIASES = {"unordered": BASELINE, "contact_ordered": PAPERS}
"""Names of the paper's two methods in enrichment_timing.csv."""

SHORT = {BASELINE: "unordered\n(paper's baseline)", PAPERS: "contact-ordered\n(the paper)"}
"""Short names for narrow places; the paper's two methods by their role in it."""

_NAMED = {
    "fem_p1": Look("linear elements (P1)", "#7a7a7a", "8"),
    "fem_p2": Look("quadratic elements (P2)", "#111111", "h"),
    "fem": Look("finite elements", "#111111", "h"),
    "linear": Look("linear responses with contact", "#3b3b8f", "h"),
    "linear_responses": Look("linear responses", "#3b3b8f", "h"),
    "enriched_responses": Look("linear responses with jumps", "#2e8b57", "*"),
    "modes": Look("reduced model of each touch", "#6a3d9a", "p"),
    "fast_fem": Look("quadratic elements, L-BFGS", "#3d5a80", "p"),
    "fem_local": Look("locally refined elements", "#b5651d", "d"),
    "contact_modes": Look("reduced model of each contact", "#6a3d9a", "p"),
    "fem_fine": Look("FEM, the standard's mesh", "#777777", "8"),
    "fem_middle": Look("middle FEM", "#666666", ">"),
    "fem_coarse": Look("coarse FEM", "#a8a8a8", "<"),
    "linear_residual": Look("linear FEM + kernel ridge", "#4477cc", "P"),
    "warped_compliance": Look("warped Green's functions", "#5aae61", "*"),
    "paper_enrichment": Look("paper 1's blends, the best of twelve", "#d55e00", "o"),
    "mass_spring": Look("springs, the best of four", "#8b1a1a", "o"),
    "springs": Look("springs", "#8b1a1a", "o"),
    "springs_volume": Look("springs with volume force", "#c0504d", "s"),
    "springs_nodal": Look("springs, one modulus per node", "#e08e45", "^"),
    "springs_nodal_volume": Look("springs, one modulus per node, volume force", "#f2c14e", "D"),
    "shape_matching": Look("shape matching", "#8064a2", "H"),
    "xpbd": Look("XPBD", "#c2185b", "v"),
    "vertex_block_descent": Look("vertex block descent", "#00838f", "^"),
    "projective_dynamics": Look("projective dynamics", "#ef6c00", "D"),
    "pod_galerkin": Look("POD-Galerkin, few cells", "#b8860b", "p"),
    "pod_gaussian": Look("POD + Gaussian process", "#a1887f", "p"),
    "pod_network": Look("POD + network", "#d7b899", "p"),
    "path_modes": Look("modes of strokes beside the path", "#3f51b5", "X"),
    "region_modes": Look("modes of strokes of the region", "#7a8f00", "P"),
    "moving_modes": Look("vibration and contact modes", "#d6278a", "X"),
    "zero": Look("no displacement at all", "#aa0000", "_"),
    "truth": Look("the truth", "#9a9a9a", "x"),
}
_LAWS = {
    "corotational": ("corotational", "#009e73"),
    "stable_neo_hookean": ("stable neo-Hookean", "#56b4e9"),
    "neo_hookean": ("neo-Hookean", "#0072b2"),
    "st_venant_kirchhoff": ("St. Venant–Kirchhoff", "#d55e00"),
}
_RAW = re.compile(r"\b[a-z0-9]+(?:_[a-z0-9]+)+\b(?!=)")
_OWN = ("#005f73", "#bb3e03", "#5a189a", "#6a994e", "#9d0208")
_SUITS = ("$\u2663$", "$\u2660$", "$\u2666$", "$\u2665$", "P", "X")


def look(model: str) -> Look:
    """Return the look of a model; a user's own gets one of five colours and six markers, always the same."""
    model = ALIASES.get(model, model)
    for looks in (_NAMED, METHODS, FITS):
        if model in looks:
            return looks[model]
    number = sum(place * letter for place, letter in enumerate(model.encode(), 1))
    return Look(spaced(model), _OWN[number % len(_OWN)], _SUITS[number % len(_SUITS)])


def short(model: str) -> str:
    """Return a name of at most two lines."""
    return SHORT.get(ALIASES.get(model, model), look(model).label.replace(" (", "\n("))


def label(model: str, setting: str) -> str:
    """Return a setting as it is named inside a sentence: "POD + RBF (modes=8)"."""
    name = f"paper 1's {look(model).label}" if minor(model) else look(model).label
    return name if setting == "default" else f"{name} ({setting})"


def minor(model: str) -> bool:
    """Return whether a model is one of paper 1's many variants, which share one curve."""
    return model.endswith(tuple(f"_{weights}" for weights in WEIGHTS))


def law_look(law: str) -> tuple[str, str]:
    """Return label and colour of a law between strain and energy; one of the user's own is named by its file."""
    if law in _LAWS:
        return _LAWS[law]
    if (stiffening := stiffening_of(law)) is not None:
        return f"exponential, b = {stiffening:g}", "#cc79a7"
    return spaced(PurePath(law).stem), "#8b0000"


def plain(text: str) -> str:
    """Replace raw names in ``text``, such as fem_fine, by their words; names of settings (``step_s=``) stay."""
    return _RAW.sub(lambda match: named(match[0]), text)


def named(name: str) -> str:
    """Return the words for a model, a method or weights; for anything else its name without underscores."""
    return WEIGHTS[name][0] if name in WEIGHTS else look(name).label
