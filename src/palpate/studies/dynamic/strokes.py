"""Simulate strokes of an instrument, beside its path or in a region, and learn modes of the touched body from them."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter, process_time
from typing import Any

import numpy as np

from palpate.bodies.body import Body
from palpate.effects.settings import Contact, Touching
from palpate.models import stroke_motion, strokes
from palpate.scenes.run_scene import compose
from palpate.scenes.settings import Scene
from palpate.stores import store
from palpate.studies.dynamic.compared_scene import Compared, ComparedScene
from palpate.studies.dynamic.fitted import Fitted, Grid, Settings


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
    """Return the strokes that modes are learnt from: neighbours of the scene's path, or random ones of a ``region``.

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


def simulate_strokes(
    body: Body, output: Any, compared: Compared, region: dict[str, Any] | None, progress: Callable
) -> None:
    """Simulate the strokes of a scene with finite elements, for the rule of that name."""
    scene = compared.of(body)
    contacts, begin = learnt_from(scene, region), process_time()
    duration_s = scene.duration_s if region is None else strokes.DURATION_S
    shown = strokes.shown(scene.body, contacts, scene.rayleigh, duration_s, progress)
    store(Strokes(shown.astype(np.float32), process_time() - begin), output.strokes, compressed=True)


def modes_of_strokes(compared: ComparedScene, shown: Strokes, grid: Grid, seed: int) -> Fitted:
    """Learn modes from simulated strokes; those of a region have not seen the path of ``compared``.

    grid : the settings of the model; of a region contact is prepared at all nodes that MORE times as many strokes pass
    """
    touching, begin = Touching(**{key: grid[key] for key in Touching.model_fields}), perf_counter()
    passing = None
    if "half_width_m" in grid:
        passing = learnt_from(compared, dict(grid) | {"strokes": MORE * grid["strokes"], "seed": seed})
    system = compose(compared.touching(compared.frames, touching), compared.particles(-1))
    body = stroke_motion.prepare(system, touching, shown.shown, passing)

    def in_modes(compared: ComparedScene, steps: int) -> Scene:
        return compared.touching(steps, stroke_motion.Learnt(**dict(touching), learnt=body))

    spent = shown.seconds + perf_counter() - begin
    return Fitted(in_modes, compared.body.material.young_pa, spent, level=-1)


MORE = 4
"""Strokes of a region that say what is in reach, for each that is learnt from."""


def stroke_modes(compared: ComparedScene, shown: Strokes, grid: Grid, seed: int) -> Settings:
    """Learn modes from strokes, and yield the steps that they are tried with."""
    fitted = modes_of_strokes(compared, shown, grid, seed)
    for count in grid["steps_per_frame"]:
        yield count * compared.frames, fitted, ""
