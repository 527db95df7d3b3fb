"""Surfaces in motion: views that a reader turns, as compressed positions and colours, and small looping GIF files."""

import json
import zlib
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.ticker import LogLocator, MaxNLocator

from palpate.files import write_whole
from palpate.report import style
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
    least, most = norm.vmin, norm.vmax
    assert least is not None and most is not None  # a norm with limits
    places = [value for value in locator.tick_values(least, most) if least <= value <= most]
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
    with write_whole(path) as temporary:
        temporary.write_text(text, encoding="ascii")


def _thinned(turnable: Turnable, count: int) -> Turnable:
    """Keep at most ``count`` evenly spaced frames of a motion, with their times and the nearest to its start frame."""
    chosen = evenly(len(turnable.positions), count)
    times = [turnable.frames["times_s"][i] for i in chosen]
    start = int(np.argmin(np.abs(np.array(chosen) - turnable.frames["start"])))
    frames = turnable.frames | {"times_s": times, "start": start}
    return replace(turnable, positions=turnable.positions[chosen], shades=turnable.shades[chosen], frames=frames)


def _json(turnable: Turnable) -> str:
    """Return JSON: positions as integers in the bounding cube, as changes between frames, by byte and compressed."""
    corner = turnable.positions.min(axis=(0, 1))
    size = float((turnable.positions.max(axis=(0, 1)) - corner).max())
    places = np.round((turnable.positions - corner) * (_STEPS / size)).astype(np.int32)
    packed = _planes(_changes(places).astype(np.int16)) + _planes(turnable.triangles.astype(np.uint32))
    packed += _planes(_changes(turnable.shades))
    frames, vertices, _ = places.shape
    view = turnable.view
    fields = {
        "counts": [frames, vertices, len(turnable.triangles)],
        "bare": turnable.bare,
        "origin": corner.round(9).tolist(),
        "step": size / _STEPS,
        "axes": view.axes.round(9).tolist(),
        "centre": view.centre.round(9).tolist(),
        "window": [round(view.width, 9), round(view.height, 9)],
        "legend": turnable.legend,
        "frames": turnable.frames,
        "packed": base64_of(zlib.compress(packed, 9)),
    }
    return json.dumps(fields, separators=(",", ":"))


def _changes(values: np.ndarray) -> np.ndarray:
    """Return the first frame and the differences between frames, contiguous per coordinate; integers may wrap."""
    changes = values.copy()
    changes[1:] = values[1:] - values[:-1]
    return np.ascontiguousarray(np.moveaxis(changes, 0, -1))


def _planes(values: np.ndarray) -> bytes:
    """Group the bytes of little-endian integers: all first bytes, then all second ones, and so on."""
    little_endian = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<"), copy=False)
    return little_endian.reshape(-1).view(np.uint8).reshape(-1, values.dtype.itemsize).T.tobytes()


_GIF_BYTES, _STRIP = 1_500_000, 24
# numbers of pictures and colours, reduced until the file is small enough
_QUALITIES = ((30, 256), (30, 128), (30, 64), (20, 64), (10, 32))
_LOOP_S, _REST_S = (1.0, 8.0), 0.8  # shortest and longest loop, and the pause at its end
_PACES = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)


def write_gif(pictures: list[np.ndarray], times: np.ndarray, path: str | Path) -> None:
    """Write ``pictures`` (height, width, 3) uint8 at ``times`` [s] as a looping GIF of at most 1.5 MB.

    It runs in real time unless a loop would then last less than 1 s or more than 8 s; the strip above each picture
    shows the time, and the factor by which the loop is slower or faster. The same pictures give the same bytes.
    """
    slowdown, note = pace(float(np.ptp(times)))
    images = [_labelled(picture, f"{time:.2f} s{note}") for picture, time in zip(pictures, times, strict=True)]
    for count, colours in _QUALITIES:
        frames = evenly(len(images), count)
        end_times = np.round(100 * slowdown * (times[frames] - times[0]))  # hundredths of a second, as GIF has them
        durations_ms = 10 * np.maximum(np.diff(end_times, append=end_times[-1] + 100 * _REST_S), 2).astype(int)
        encoded = _encoded([images[i] for i in frames], colours, durations_ms.tolist())
        if len(encoded) <= _GIF_BYTES:
            break
    with write_whole(path) as temporary:
        temporary.write_bytes(encoded)


def evenly(length: int, count: int) -> list[int]:
    """Return at most ``count`` evenly spaced indices from the first to the last of ``length``."""
    return np.unique(np.linspace(0, length - 1, count).round().astype(int)).tolist()


def pace(duration_s: float) -> tuple[float, str]:
    """Return how many seconds a loop takes for a second of a scene of ``duration_s``, by _LOOP_S, and a note on it."""
    shortest_s, longest_s = _LOOP_S
    if duration_s < shortest_s:
        pace = next((p for p in _PACES if p * duration_s >= shortest_s), _PACES[-1])
        return pace, f", {pace}× slower"
    pace = next((p for p in _PACES if duration_s / p <= longest_s), _PACES[-1])
    return 1 / pace, f", {pace}× faster" if pace > 1 else ""


def _labelled(picture: np.ndarray, label: str):
    """Put the picture below a strip that shows the time, as a PIL image."""
    from matplotlib import font_manager
    from PIL import Image, ImageDraw, ImageFont

    height, width, _ = picture.shape
    image = Image.new("RGB", (width, height + _STRIP), "white")
    image.paste(Image.fromarray(picture), (0, _STRIP))
    font = ImageFont.truetype(font_manager.findfont("DejaVu Sans"), 14)
    ImageDraw.Draw(image).text((6, 4), label, fill=style.INK, font=font)
    return image


def _encoded(images: list, colours: int, lasting: list[int]) -> bytes:
    """Encode a GIF with one palette for all images, so that static parts take few bytes and do not flicker."""
    from PIL import Image

    samples = [images[i] for i in evenly(len(images), 9)]
    width, height = samples[0].size
    mosaic = Image.new("RGB", (width, height * len(samples)), "white")
    for row, image in enumerate(samples):
        mosaic.paste(image, (0, row * height))
    palette = mosaic.quantize(colours, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    first_image, *other_images = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    file = BytesIO()
    first_image.save(file, "GIF", save_all=True, append_images=other_images, duration=lasting, loop=0, optimize=False)
    return file.getvalue()
