"""Interactive surfaces that a reader can rotate in the report: compressed positions and colours of every frame."""

import json
import zlib
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.ticker import LogLocator, MaxNLocator

from palpate.files import write_whole
from palpate.report import gif
from palpate.report.page_assets import base64_of
from palpate.report.render import View

_STEPS = 2**14 - 1  # of the scene's size: 12 µm of 0.2 m, below what a screen can show
_SHADES = 254  # of the colour map; the last two colours of the palette are for rigid things and for held nodes
THING, HELD = 254, 255
_BYTES = 600_000
_FRAMES = (60, 40, 20, 10, 4)


@dataclass(frozen=True, eq=False)
class Turnable:
    """One surface over f frames.

    positions : (f, n, 3) [m]; triangles : (m, 3); shades : (f, n) uint8, indices into the palette
    bare : triangles from this index on are drawn without edges, as those of rigid things
    legend : result of ``legend``; frames : further data on the frames for the page: their times, or choices among them
    """

    view: View
    positions: np.ndarray
    triangles: np.ndarray
    shades: np.ndarray
    bare: int
    legend: dict
    frames: dict


def shades(values: np.ndarray, norm: Normalize) -> np.ndarray:
    """Convert ``values`` to indices into the palette (…,) uint8; values outside the limits get its ends."""
    share = np.clip(np.ma.filled(norm(np.clip(values, norm.vmin, norm.vmax)), 0.0), 0.0, 1.0)
    return np.round(share * (_SHADES - 1)).astype(np.uint8)


def legend(label: str, norm: Normalize, colours: str) -> dict:
    """Describe the colour scale: label, the palette (256, 3) and ticks (position on the bar from 0 to 1, text)."""
    palette = matplotlib.colormaps[colours](np.linspace(0, 1, _SHADES))[:, :3]
    palette = np.vstack([palette, [0xB3 / 255, 0xBF / 255, 0xCA / 255], [0.2, 0.2, 0.2]])
    locator = LogLocator() if isinstance(norm, LogNorm) else MaxNLocator(4)
    low, high = norm.vmin, norm.vmax
    assert low is not None and high is not None  # a norm with limits
    places = [value for value in locator.tick_values(low, high) if low <= value <= high]
    ticks = [[round(float(norm(value)), 4), f"{value:g}"] for value in places]
    return {"label": label, "palette": base64_of(np.round(255 * palette).astype(np.uint8).tobytes()), "ticks": ticks}


def write(turnable: Turnable, path: str | Path) -> None:
    """Write JSON that the page's script reads; the same surface gives the same bytes.

    A motion is reduced to fewer, evenly spaced frames until the file has at most 0.6 MB, because a page holds many.
    """
    text = _json(turnable)
    for count in _FRAMES if "times_s" in turnable.frames else ():
        if len(text) <= _BYTES:
            break
        text = _json(_thinned(turnable, count))
    with write_whole(path) as part:
        part.write_text(text, encoding="ascii")


def _thinned(turnable: Turnable, count: int) -> Turnable:
    """Keep at most ``count`` frames of a motion."""
    kept = gif.evenly(len(turnable.positions), count)
    times = [turnable.frames["times_s"][i] for i in kept]
    start = int(np.argmin(np.abs(np.array(kept) - turnable.frames["start"])))
    frames = turnable.frames | {"times_s": times, "start": start}
    return replace(turnable, positions=turnable.positions[kept], shades=turnable.shades[kept], frames=frames)


def _json(turnable: Turnable) -> str:
    """Encode positions as integers of the bounding cube, take differences between frames, group bytes and compress."""
    low = turnable.positions.min(axis=(0, 1))
    size = float((turnable.positions.max(axis=(0, 1)) - low).max())
    places = np.round((turnable.positions - low) * (_STEPS / size)).astype(np.int32)
    body = _planes(_changes(places).astype(np.int16)) + _planes(turnable.triangles.astype(np.uint32))
    body += _planes(_changes(turnable.shades))
    frames, vertices, _ = places.shape
    view = turnable.view
    head = {
        "counts": [frames, vertices, len(turnable.triangles)],
        "bare": turnable.bare,
        "origin": low.round(9).tolist(),
        "step": size / _STEPS,
        "axes": view.axes.round(9).tolist(),
        "centre": view.centre.round(9).tolist(),
        "window": [round(view.width, 9), round(view.height, 9)],
        "legend": turnable.legend,
        "frames": turnable.frames,
        "packed": base64_of(zlib.compress(body, 9)),
    }
    return json.dumps(head, separators=(",", ":"))


def _changes(values: np.ndarray) -> np.ndarray:
    """Return the first frame and the differences between frames, contiguous per coordinate; integers may wrap."""
    moved = values.copy()
    moved[1:] = values[1:] - values[:-1]
    return np.ascontiguousarray(np.moveaxis(moved, 0, -1))


def _planes(values: np.ndarray) -> bytes:
    """Group the bytes of little-endian integers: all first bytes, then all second ones, and so on."""
    small = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<"), copy=False)
    return small.reshape(-1).view(np.uint8).reshape(-1, values.dtype.itemsize).T.tobytes()
