"""Simulate the strokes that modes of touch are learnt from, once for a body and a path: beside it, or in its region."""

from collections.abc import Callable
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np

from palpate.bodies import body_file
from palpate.effects.settings import Contact
from palpate.models import strokes
from palpate.run.job import steps
from palpate.stores import store
from palpate.studies.dynamic.compared_scene import Compared, ComparedScene


@dataclass(frozen=True, eq=False)
class Strokes:
    """Motions (s, n, 3) [m] of quadratic elements on the reference's level, and the processor's time [s] they took."""

    shown: np.ndarray
    seconds: float


def contact_of(compared: ComparedScene) -> Contact:
    """Return the contact of a scene that is touched."""
    assert compared.loads.contact is not None
    return compared.loads.contact


def learnt_from(compared: ComparedScene, region: dict | None) -> list[Contact]:
    """Return the strokes: the path's neighbours, or random ones of a ``region``.

    region : ``half_width_m`` [m], how many ``strokes``, and the ``seed``
    Strokes fill a square that is WIDER than the region, so that those at its edge have some on both sides.
    """
    contact = contact_of(compared)
    if region is None:
        return strokes.neighbours(contact)
    square = WIDER * region["half_width_m"], region["strokes"], region["seed"]
    return strokes.roaming(compared.particles(-1), contact, *square)


WIDER = 1.3
"""Half width of the square that strokes are shown in, over that of the region."""


def simulate_strokes(input: Any, output: Any, compared: Compared, region: dict[str, Any] | None, say: Callable) -> Any:
    """Simulate the strokes of a scene with finite elements, for the rule of that name."""
    scene = compared.of(body_file.load(input.body))
    contacts, begin = learnt_from(scene, region), process_time()
    duration_s = scene.duration_s if region is None else strokes.DURATION_S
    shown = strokes.shown(scene.body, contacts, scene.rayleigh, duration_s, steps(say, f"{scene.name}: stroke"))
    store(Strokes(shown.astype(np.float32), process_time() - begin), output.strokes, compressed=True)
