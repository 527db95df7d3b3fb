"""What each way of finding spring parameters is called and drawn as, in every figure and sentence."""

from palpate.errors import InputError
from palpate.figures.style import Look

FITS = {
    "uniform": Look("one E for all nodes", "#7d7d7d", "X"),
    "van_gelder": Look("Van Gelder", "#6b4f2a", "P"),
    "lloyd": Look("Lloyd", "#e6b400", "v"),
    "genetic": Look("genetic algorithm (the paper)", "#d55e00", "o"),
    "cma_es": Look("CMA-ES", "#0072b2", "s"),
    "gradient": Look("gradient by the adjoint", "#009e73", "*"),
    "gradient_smooth": Look("gradient, moduli kept alike", "#cc79a7", "D"),
    "gradient_all": Look("gradient, fitted to all presses", "#66c2a5", "*"),
}
"""Every way that a table may name, in table order."""

DASHES = {False: "--", True: "-"}
"""Without the volume force, and with it."""

FORCES = {False: "springs alone", True: "springs and volume force"}


def look(method: str) -> Look:
    """The look of a way; InputError for one that has none, so that no figure invents a colour."""
    try:
        return FITS[method]
    except KeyError:
        raise InputError(
            f"method {method} has no colour: give it one in palpate/figures/springs/spring_looks.py"
        ) from None
