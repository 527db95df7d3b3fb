"""Cost of each effect of a scene, and the scene's error without it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd

from palpate.bodies.particles import Particles
from palpate.errors import InputError, NotConverged
from palpate.scenes.build_system import effect_names
from palpate.scenes.motion import Motion
from palpate.scenes.run_scene import run
from palpate.scenes.scene import Scene

ENOUGH_S = 5.0
"""Total time [s] after which runs are not repeated: a long run is a mean over many steps."""

REST = "integrator"
"""Name in the table of the rest of a step, outside all effects: linear solves and the loop itself."""


def cost(scene: Scene, particles: Particles, repeats: int) -> pd.DataFrame:
    """Measure the cost of each effect and of the integrator, one row each.

    The columns are scene, effect, ms_per_step, share_of_step and memory_kb. They are those of the run with the median
    time of ``repeats`` runs, or of as many as take ENOUGH_S; a short run before them compiles the code.
    """
    run(replace(scene, duration_s=2 * scene.step_s), particles)
    runs = [run(scene, particles)]
    while len(runs) < repeats and sum(r.seconds for r in runs) < ENOUGH_S:
        runs.append(run(scene, particles))
    runs.sort(key=lambda r: r.seconds)
    middle = runs[len(runs) // 2]
    seconds = dict(middle.effect_seconds)
    seconds[REST] = middle.seconds - sum(seconds.values())
    return pd.DataFrame(
        {
            "scene": scene.name,
            "effect": list(seconds),
            "ms_per_step": [1e3 * s / middle.steps for s in seconds.values()],
            "share_of_step": [s / middle.seconds for s in seconds.values()],
            "memory_kb": [middle.effect_kb.get(name, np.nan) for name in seconds],
        }
    )


def left_out(scene: Scene, particles: Particles, whole: Motion, progress: Callable = iter) -> pd.DataFrame:
    """Compute the error of the scene without each effect, one row each: scene, effect, error_if_left_out, note.

    The error is the root mean square over frames and nodes of the distance to the ``whole`` motion, divided by the
    largest displacement in the latter. The elastic effect has no error, since without it there is no body. Where the
    scene cannot be run without an effect, the error is NaN and the note gives the reason.
    """
    effects = effect_names(scene, particles)
    rows = [[scene.name, effects[0], np.nan, "it holds the body together"]]
    peak = float(np.linalg.norm(whole.positions - particles.nodes, axis=-1).max())
    for effect in progress(effects[1:]):
        try:
            other = run(scene, particles, without=effect).motion
            away = np.linalg.norm(other.positions - whole.positions, axis=-1)
            error = float(np.sqrt((away**2).mean()))
            rows.append([scene.name, effect, error / peak if peak else np.nan, "" if peak else "the scene is still"])
        except (NotConverged, InputError) as failure:
            rows.append([scene.name, effect, np.nan, str(failure)])
    return pd.DataFrame(rows, columns=["scene", "effect", "error_if_left_out", "note"])
