"""Make a body of a mesh file or a scan as ``palpate init`` does: ``palpate.load``."""

import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from palpate.bodies.body import Body
from palpate.errors import InputError, explained
from palpate.setting_types import Number, Pair, Positive, Where, check

ARGUMENTS = {"scale": "scale_m", "threshold": "threshold_hu", "hold": "hold", "label": "label"}
"""Of ``load``, by the option of ``palpate init`` that they are."""


def load(
    path: str | Path,
    *,
    mask: str | Path | None = None,
    label: int | str | Sequence[int | str] = (),
    threshold_hu: Sequence[float] | None = None,
    scale_m: float | None = None,
    hold: Literal["below", "above", "left", "right", "front", "back"] | None = None,
    young_pa: float = 3000.0,
    poisson: float = 0.3,
    density_kg_m3: float = 1050.0,
) -> Body:
    """Make the body of a mesh file (STL, OBJ, PLY, gmsh, VTK ...) or of an organ in a CT (DICOM, NIfTI, NRRD, MHD).

    mask, label : a file that marks the organ on the grid of the CT, and its label or labels there; or threshold_hu,
        its lowest and highest CT number
    scale_m : length of a mesh file's unit [m]; guessed if it is not given
    hold : the side that lies on a bed of its own tissue; chosen if it is not given
    Warns of all that was found, guessed and changed; raises InputError, with the reason, for what makes no body.
    """
    check(path=(Where, path), mask=(Where | None, mask), hold=(str | None, hold), scale_m=(Positive | None, scale_m))
    check(label=(int | str | Sequence[int | str], label), threshold_hu=(Pair[Number] | None, threshold_hu))
    with explained(), _in_arguments():
        from palpate.init.choose import choose
        from palpate.init.recognise import HOLDS, recognise

        if hold is not None and hold not in HOLDS:
            raise InputError(f"hold is {hold!r}; give {', '.join(HOLDS[:-1])} or {HOLDS[-1]}.")
        paths = [Path(path)] if mask is None else [Path(path), Path(mask)]
        labels = [label] if isinstance(label, int | str) else list(label)
        data = recognise(paths, labels, None if threshold_hu is None else list(threshold_hu), scale_m=scale_m)
        for line in [*data.assumed, *data.warned]:
            warnings.warn(_argument(f"{path}: {line}"), stacklevel=2)
        entry = data.entry.but(young_pa=young_pa, poisson=poisson, density_kg_m3=density_kg_m3)
        return choose(data.name, entry, hold or data.lies or None).body


@contextmanager
def _in_arguments() -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise InputError(_argument(str(error))) from error


def _argument(said: str) -> str:
    """Return a sentence on options as one on arguments: scale_m=0.002 for --scale 0.002."""
    option = rf"(?<![\w/.-])--({'|'.join(ARGUMENTS)})\b( [\d.e+-]*\d)?"
    return re.sub(option, lambda match: ARGUMENTS[match[1]] + (match[2] or "").replace(" ", "="), said)
