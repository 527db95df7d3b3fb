"""Tabulate the force of each model's instruments over time, and of the truth or the standard, frame by frame."""

from collections.abc import Iterator

import numpy as np

from palpate.table_declaration import Table

LIMIT = "limit"
"""The setting of the curve that others are compared with."""

DYNAMIC_FORCE = Table(
    "dynamic_force",
    "The force of each instrument on the body in each frame, of every model and setting, where something touches.",
    """
    scene model setting instrument: a scene, what answers, and the instrument's number; the setting "limit" is what
        errors are from
    time_s: the end of the frame [s]
    force_x_n force_y_n force_z_n: mean force over the frame [N]
    """,
    always=False,
)


def curve(scene: str, model: str, setting: str, ends_s: np.ndarray, forces: np.ndarray) -> Iterator[dict]:
    """Yield rows of dynamic_force.csv of a model, whose ``forces`` (f, k, 3) [N] are of frames that end at ``ends_s``.

    Frames that nothing is compared in are left out.
    """
    for end, each in zip(ends_s, forces, strict=False):
        for instrument, force in enumerate(each):
            row = {"scene": scene, "model": model, "setting": setting, "instrument": instrument, "time_s": end}
            yield row | dict(zip(("force_x_n", "force_y_n", "force_z_n"), force, strict=True))
