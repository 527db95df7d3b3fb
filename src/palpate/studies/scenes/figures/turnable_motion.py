"""Interactive motion of a scene, which the reader can rotate and play in the report."""

from pathlib import Path

import numpy as np
from matplotlib.colors import Normalize

from palpate.report import gif, render, style, turnable
from palpate.scenes.motion import Motion
from palpate.studies.scenes.figures.motion_stills import Scenery

_FRAMES = 60


def write(motion: Motion, path: str | Path) -> None:
    """Write at most 60 frames of the surface, coloured as in the stills, of the rigid things, and their times."""
    scenery = Scenery(motion)
    kept = np.array(gif.evenly(len(motion.times), _FRAMES))
    norm = Normalize(0.0, scenery.limit)
    renumber = np.full(len(motion.rest), -1)
    renumber[scenery.surface] = np.arange(len(scenery.surface))
    shades = turnable.shades(scenery.millimetres[np.ix_(kept, scenery.surface)], norm)
    shades[:, renumber[scenery.held]] = turnable.HELD
    positions, triangles = [motion.positions[np.ix_(kept, scenery.surface)]], [renumber[motion.triangles]]
    for thing in scenery.things:
        solids = [render.solid(thing.positions[frame], thing) for frame in kept]
        points = np.array([solid.points for solid in solids])
        triangles.append(solids[0].regular_faces + sum(part.shape[1] for part in positions))
        positions.append(points)
        shades = np.hstack([shades, np.full(points.shape[:2], turnable.THING, np.uint8)])
    times = motion.times[kept]
    pace, note = gif.pace(float(np.ptp(times)))
    peak = int(np.argmax(scenery.millimetres[np.ix_(kept, scenery.surface)].max(axis=1)))
    turnable.write(
        turnable.Turnable(
            scenery.view,
            np.concatenate(positions, axis=1),
            np.vstack(triangles),
            shades,
            len(triangles[0]),
            turnable.legend("displacement [mm]", norm, style.DISPLACEMENT),
            {"times_s": times.round(6).tolist(), "pace": pace, "note": note.removeprefix(", "), "start": peak},
        ),
        path,
    )
