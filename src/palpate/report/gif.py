"""Animations as small looping GIF files."""

from io import BytesIO
from pathlib import Path

import numpy as np

from palpate.files import write_whole
from palpate.report import style

_BYTES, _STRIP = 1_500_000, 24
# numbers of pictures and colours, reduced until the file is small enough
_QUALITIES = ((30, 256), (30, 128), (30, 64), (20, 64), (10, 32))
_LOOP_S, _REST_S = (1.0, 8.0), 0.8  # shortest and longest loop, and the pause at its end
_PACES = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)


def write(pictures: list[np.ndarray], times: np.ndarray, path: str | Path) -> None:
    """Write ``pictures`` (height, width, 3) uint8 at ``times`` [s] as a looping GIF of at most 1.5 MB.

    It runs in real time unless a loop would then last less than 1 s or more than 8 s; the strip above each picture
    shows the time, and the factor by which the loop is slower or faster. The same pictures give the same bytes.
    """
    slow, note = pace(float(np.ptp(times)))
    images = [_labelled(picture, f"{time:.2f} s{note}") for picture, time in zip(pictures, times, strict=True)]
    for count, colours in _QUALITIES:
        shown = evenly(len(images), count)
        ends = np.round(100 * slow * (times[shown] - times[0]))  # hundredths of a second, the unit of the format
        lasting = 10 * np.maximum(np.diff(ends, append=ends[-1] + 100 * _REST_S), 2).astype(int)
        encoded = _encoded([images[i] for i in shown], colours, lasting.tolist())
        if len(encoded) <= _BYTES:
            break
    with write_whole(path) as part:
        part.write_bytes(encoded)


def evenly(length: int, count: int) -> list[int]:
    """Return at most ``count`` evenly spaced indices from the first to the last of ``length``."""
    return np.unique(np.linspace(0, length - 1, count).round().astype(int)).tolist()


def pace(duration_s: float) -> tuple[float, str]:
    """Return the seconds of the loop per second of the scene, and a note on it."""
    low, high = _LOOP_S
    if duration_s < low:
        pace = next((p for p in _PACES if p * duration_s >= low), _PACES[-1])
        return pace, f", {pace}× slower"
    pace = next((p for p in _PACES if duration_s / p <= high), _PACES[-1])
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

    some = [images[i] for i in evenly(len(images), 9)]
    width, height = some[0].size
    mosaic = Image.new("RGB", (width, height * len(some)), "white")
    for row, image in enumerate(some):
        mosaic.paste(image, (0, row * height))
    palette = mosaic.quantize(colours, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    first, *others = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    file = BytesIO()
    first.save(file, "GIF", save_all=True, append_images=others, duration=lasting, loop=0, optimize=False)
    return file.getvalue()
