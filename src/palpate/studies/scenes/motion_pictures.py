"""Pictures of a scene in motion: a row of stills, a short animation that loops, and a view that turns and plays."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from palpate.report import render, style, turnable
from palpate.run.job import stem
from palpate.scenes.motion import Motion, Moved, write_series
from palpate.stores import stored

_PIXELS = 480
_COARSE = 800  # triangles; the edges of more would darken the picture


@style.styled
def stills(motion: Motion, count: int) -> Figure:
    """Draw ``count`` moments in a row, coloured by displacement from the rest shape on one scale.

    The moments are evenly spaced in both time and the distance that the surface travels, so that a fast press is not
    missed, and one is that of the largest displacement. Dark balls are held nodes, the grey line is the outline of the
    rest shape. Displacements are to scale.
    """
    scenery = Scenery(motion)
    frames = _moments(motion, scenery.surface, count)
    aspect = scenery.view.width / scenery.view.height
    figure, axes = style.grid(1, len(frames), aspect, 1.9 * min(1.0, aspect))
    with render.Stage(*_size(aspect)) as stage:
        rest = scenery.draw(stage, motion.rest, np.zeros(len(motion.rest)))
        for axis, frame in zip(axes[0], frames, strict=True):
            style.place(axis, scenery.picture(stage, frame), f"{motion.times[frame]:.3g} s")
            style.outline(axis, rest)
    axes[0, 0].set_title(motion.scene)
    style.colour_bar(figure, Normalize(0, scenery.limit), style.DISPLACEMENT, "displacement [mm]")
    return figure


def animate(motion: Motion, path: str | Path) -> None:
    """Write a looping GIF of at most 30 frames with the view and the colours of ``stills``."""
    scenery = Scenery(motion)
    frames = turnable.evenly(len(motion.times), 30)
    with render.Stage(*_size(scenery.view.width / scenery.view.height)) as stage:
        turnable.write_gif([scenery.picture(stage, frame) for frame in frames], motion.times[frames], path)


class Scenery:
    """What all pictures of a motion share: view, surface nodes, displacements [mm], their limit, held nodes, things."""

    def __init__(self, motion: Motion):
        self._motion = motion
        self.surface = np.unique(motion.triangles)
        displacements = motion.positions - motion.rest
        self.millimetres = 1e3 * np.linalg.norm(displacements, axis=2)
        self.limit = float(self.millimetres[:, self.surface].max()) or 1.0  # a body at rest has one colour
        self.held = np.intersect1d(motion.held, self.surface)
        all_places = np.vstack([motion.rest[self.surface], *motion.positions[:, self.surface]])
        self.things = [*(_seen(thing, all_places) for thing in motion.obstacles), *motion.drawn]
        peak = self.surface[np.argmax(self.millimetres[:, self.surface].max(axis=0))]
        a, b, c = motion.rest[motion.triangles[(motion.triangles == peak).any(axis=1)]].transpose(1, 0, 2)
        normal = np.cross(b - a, c - a).sum(axis=0)
        normal = normal / (np.linalg.norm(normal) or 1.0)  # zero if the triangles around the peak have no area
        if any(thing.kind == "floor" for thing in self.things):
            normal[motion.up] = max(normal[motion.up], 0.0)  # seen from below, a floor would hide everything
        axes = render.directions(all_places, normal, motion.up)
        boxes = [thing.positions.reshape(-1, 3) + r for thing in self.things for r in (-thing.radius_m, thing.radius_m)]
        view = render.frame(axes, [all_places, *boxes])
        # very high or very flat views get more space at the sides
        self.view = replace(view, width=max(view.width, 0.6 * view.height), height=max(view.height, view.width / 3.0))
        self._ball = 0.011 * self.view.width

    def picture(self, stage: render.Stage, frame: int) -> np.ndarray:
        """Render one frame, (height, width, 3) uint8."""
        things = [partial(render.Stage.rigid, points=t.positions[frame], thing=t) for t in self.things]
        return self.draw(stage, self._motion.positions[frame], self.millimetres[frame], things)

    def draw(
        self, stage: render.Stage, nodes: np.ndarray, millimetres: np.ndarray, things: Sequence = ()
    ) -> np.ndarray:
        """Render nodes (n, 3) [m], coloured by their displacement (n,) [mm], and ``things``, as ``picture`` does."""
        motion = self._motion
        actors = [
            *things,
            lambda s: s.surface(
                nodes, motion.triangles, millimetres, (0, self.limit), style.DISPLACEMENT,
                edges=len(motion.triangles) <= _COARSE,
            )
        ]  # fmt: skip
        if len(self.held):
            actors.append(lambda s: s.dots(nodes[self.held], self._ball))
        return stage.picture(self.view, actors)


def _seen(thing: Moved, cloud: np.ndarray) -> Moved:
    """Return the thing as it is drawn: of an endless floor only the rectangle under the points ``cloud`` (n, 3) [m]."""
    if thing.kind != "floor":
        return thing
    up = int(np.argmin(np.ptp(thing.positions[0], axis=0)))
    lower, upper = (np.delete(corner, up) for corner in (cloud.min(axis=0), cloud.max(axis=0)))
    margin = 0.1 * (upper - lower).max()
    (west, south), (east, north) = lower - margin, upper + margin
    rectangle = np.insert(np.array([[west, south], [east, south], [east, north], [west, north]]), up, 0.0, axis=1)
    heights = thing.positions[:, :1, up]
    positions = np.repeat(rectangle[None], len(heights), axis=0)
    positions[:, :, up] = heights
    return replace(thing, positions=positions, triangles=np.array([[0, 1, 2], [0, 2, 3]]))


def _moments(motion: Motion, surface: np.ndarray, count: int) -> list[int]:
    """Choose ``count`` frames, evenly spaced in relative time plus relative distance travelled; one shows the peak."""
    displacements = motion.positions[:, surface] - motion.positions[0, surface]
    peak = int(np.linalg.norm(displacements, axis=2).max(axis=1).argmax())
    mean_travel = np.linalg.norm(np.diff(displacements, axis=0), axis=2).mean(axis=1)
    distance = np.concatenate([[0.0], np.cumsum(mean_travel)])
    since_start = motion.times - motion.times[0]
    progress = since_start / (since_start[-1] or 1.0) + distance / (distance[-1] or 1.0)
    frames = [int(np.argmin(np.abs(progress - target))) for target in np.linspace(0.0, progress[-1], count)]
    if count > 2 and 0 < peak < len(since_start) - 1:
        nearest_inner = 1 + int(np.argmin(np.abs(progress[frames[1:-1]] - progress[peak])))
        frames[nearest_inner] = peak
    return sorted(set(frames))


def _size(aspect: float) -> tuple[int, int]:
    """Return width and height of a picture [pixel]."""
    return round(_PIXELS * min(1.0, aspect)), round(_PIXELS / max(1.0, aspect))


def write(motion: Motion, path: str | Path) -> None:
    """Write at most 60 frames of the surface, coloured as in the stills, of the rigid things, and their times."""
    scenery = Scenery(motion)
    frames = np.array(turnable.evenly(len(motion.times), 60))
    norm = Normalize(0.0, scenery.limit)
    renumber = np.full(len(motion.rest), -1)
    renumber[scenery.surface] = np.arange(len(scenery.surface))
    colours = turnable.shades(scenery.millimetres[np.ix_(frames, scenery.surface)], norm)
    colours[:, renumber[scenery.held]] = turnable.HELD
    positions, triangles = [motion.positions[np.ix_(frames, scenery.surface)]], [renumber[motion.triangles]]
    for thing in scenery.things:
        solid_by_frame = [render.solid(thing.positions[frame], thing) for frame in frames]
        points = np.array([solid.points for solid in solid_by_frame])
        triangles.append(solid_by_frame[0].regular_faces + sum(earlier.shape[1] for earlier in positions))
        positions.append(points)
        colours = np.hstack([colours, np.full(points.shape[:2], turnable.THING, np.uint8)])
    times = motion.times[frames]
    pace, note = turnable.pace(float(np.ptp(times)))
    peak = int(np.argmax(scenery.millimetres[np.ix_(frames, scenery.surface)].max(axis=1)))
    legend = turnable.legend("displacement [mm]", norm, style.DISPLACEMENT)
    played = {"times_s": times.round(6).tolist(), "pace": pace, "note": note.removeprefix(", "), "start": peak}
    surfaces = np.concatenate(positions, axis=1), np.vstack(triangles)
    turnable.write(turnable.Turnable(scenery.view, *surfaces, colours, len(triangles[0]), legend, played), path)


def draw_motion(input, output):
    """Draw a motion as stills, animation, view and series, for the rule of that name."""
    moved = stored(Motion, input.motion)
    style.save(stills(moved, count=6), stem(output.stills))
    animate(moved, output.animation)
    write(moved, output.turnable)
    write_series(moved, output.series)
