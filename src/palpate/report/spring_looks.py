"""Label, colour and marker of each method for spring parameters, in every figure and sentence."""

from palpate.errors import InputError
from palpate.report.style import Look

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
"""Every method that may occur in a table, in table order."""

DASHES = {False: "--", True: "-"}
"""Line styles without and with the volume force."""

FORCES = {False: "springs alone", True: "springs and volume force"}


def look(method: str) -> Look:
    """Look up the look of a method; raises InputError for an unknown one, so that no figure invents a colour."""
    try:
        return FITS[method]
    except KeyError:
        raise InputError(
            f"method {method} has no colour: give it one in palpate/studies/springs/figures/spring_looks.py"
        ) from None
