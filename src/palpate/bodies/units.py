"""Length of a mesh file's unit: guessed from the size that an organ may have, or checked against it."""

import warnings

import numpy as np

from palpate.errors import InputError

# an organ's longest side [m]: from a gland to a stomach or a pair of lungs
ORGAN_M = (0.02, 0.6)
# in this order, since files in millimetres are the most frequent: 20 to 60 units could also be centimetres
UNITS = {"millimetre": 1e-3, "centimetre": 1e-2, "metre": 1.0, "micrometre": 1e-6}
# units that are never guessed, and may be meant
RARE_UNITS = {"inch": 0.0254}
# sizes [m] that a given scale may make without a warning, and at all
USUAL_M, POSSIBLE_M = (0.01, 1.0), (0.002, 5.0)


def guess_scale(size: float) -> tuple[str, float] | None:
    """Guess the unit in which a longest side of ``size`` units is an organ's: name and length [m]; None if none is."""
    return next(iter(_organ_sized(size, UNITS).items()), None)


def other_units(size: float, taken_m: float) -> dict[str, float]:
    """Return the units but that of ``taken_m`` [m] in which a longest side of ``size`` is an organ's: lengths [m]."""
    return {name: scale for name, scale in _organ_sized(size, UNITS | RARE_UNITS).items() if scale != taken_m}


def _organ_sized(size: float, units: dict[str, float]) -> dict[str, float]:
    low, high = ORGAN_M
    return {name: scale for name, scale in units.items() if low <= size * scale <= high}


def choose_scale(source: str, points: np.ndarray, scale_m: float | None) -> float:
    """Check the given length of the file's unit [m], or guess it from the points, (n, 3), and warn of the guess.

    Raises InputError if no guess is plausible, or if the given scale makes a body that no organ can be.
    """
    size = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    guess = guess_scale(size)
    if scale_m is None:
        return _guessed(source, size, guess)
    if not 0 < scale_m < np.inf:
        raise InputError(f"{source}: scale_m is {scale_m}; give the length of the file's unit in metres.")
    likely = f"if its unit is the {guess[0]}, give scale_m: {guess[1]:g}" if guess else "check scale_m"
    if not POSSIBLE_M[0] <= size * scale_m <= POSSIBLE_M[1]:
        raise InputError(f"{source}: scale_m {scale_m:g} makes a body {in_words(size * scale_m)} long; {likely}.")
    if not USUAL_M[0] <= size * scale_m <= USUAL_M[1]:
        warnings.warn(
            f"{source}: scale_m {scale_m:g} makes a body {in_words(size * scale_m)} long, which no organ is; {likely}.",
            stacklevel=3,
        )
    return scale_m


def in_words(length_m: float) -> str:
    """Write a length with the unit that suits it, such as "82 mm"."""
    for unit, factor in (("m", 1.0), ("cm", 100.0), ("mm", 1e3)):
        if length_m * factor >= 1 and not (unit == "cm" and length_m < 0.1):
            break
    return f"{length_m * factor:.3g} {unit}"


def _guessed(source: str, size: float, guess: tuple[str, float] | None) -> float:
    if guess is None:
        example = f"{0.2 / size:.3g} makes it 20 cm long" if size > 0 else "such as 0.001 for millimetres"
        raise InputError(
            f"{source}: its longest side is {size:.4g} units, which is an organ's size neither in millimetres nor in "
            f"centimetres or metres; give scale_m, the length of the file's unit in metres ({example})."
        )
    name, scale = guess
    warnings.warn(
        f"{source}: scale_m is not given; its unit is taken for the {name}, which makes the body "
        f"{in_words(size * scale)} long; give scale_m: {scale:g} if that is right, or the unit's length in metres.",
        stacklevel=3,
    )
    return scale
