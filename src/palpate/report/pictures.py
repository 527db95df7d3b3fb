"""Make pictures, and views that turn, into self-contained HTML."""

import base64
import re
from html import escape
from io import BytesIO
from pathlib import Path

from palpate.files import require_file

_SVG_BYTES = 200_000
_QUALITY = 88  # of pictures that are too large as SVG: a fifth of a PNG's bytes, without a visible difference
_PNG_DPI, _CSS_DPI = 160, 96


def image(stem: Path, alt: str) -> str:
    """Return ``stem``.svg if it is small, else ``stem``.png as WebP, as an ``img`` of its natural size.

    Raises InputError if the figure is missing.
    """
    data, width, height = _data(stem)
    return f'<img alt="{escape(alt)}" width="{width}" height="{height}" src="{data}">'


def _data(stem: Path) -> tuple[str, int, int]:
    """Return a figure as the address of an ``img``, and its width and height [CSS pixel]."""
    vector, raster = (require_file(stem.with_name(f"{stem.name}.{suffix}")) for suffix in ("svg", "png"))
    if vector.stat().st_size <= _SVG_BYTES:
        data = vector.read_bytes()
        return f"data:image/svg+xml;base64,{base64.b64encode(data).decode()}", *_svg_size(data)
    data, (width, height) = _webp(raster)
    scale = _CSS_DPI / _PNG_DPI
    return f"data:image/webp;base64,{base64.b64encode(data).decode()}", round(scale * width), round(scale * height)


def _svg_size(data: bytes) -> tuple[int, int]:
    """Read the size of a drawing [CSS pixel] from its first lines, which give it in points."""
    found = re.search(rb'<svg[^>]*?height="([\d.]+)pt"[^>]*?width="([\d.]+)pt"', data[:2000], re.DOTALL)
    height, width = (float(number) * _CSS_DPI / 72 for number in found.groups()) if found else (600, 800)
    return round(width), round(height)


def _webp(path: Path) -> tuple[bytes, tuple[int, int]]:
    """Convert a picture to WebP, and return its size [pixel] too; the same picture gives the same bytes."""
    from PIL import Image

    file, picture = BytesIO(), Image.open(path)
    picture.convert("RGB").save(file, "WEBP", quality=_QUALITY, method=4)
    return file.getvalue(), picture.size


def figure(folder: Path, name: str, caption: str, small: str | None = None) -> str:
    """Return a picture in a box of its own with its caption (HTML); on narrow screens the picture ``small``."""
    shown = image(folder / name, name.replace("_", " "))
    if small:
        address, width, height = _data(folder / small)
        source = f'<source media="(max-width: 44rem)" srcset="{address}" width="{width}" height="{height}">'
        shown = f"<picture>{source}{shown}</picture>"
    return (
        f'<figure id="figure_{name}">\n<div class="pane">{shown}</div>\n<figcaption>{caption}</figcaption>\n</figure>'
    )


def turnable(folder: Path, name: str, title: str, caption: str) -> str:
    """Return the surface in ``name``.json, to be turned, under its title, with its caption (HTML).

    Raises InputError if it is missing.
    """
    data = require_file(folder / f"{name}.json").read_text(encoding="ascii").replace("<", "\\u003c")
    return (
        f'<figure class="turn" id="turn_{name}" data-title="{escape(title)}">\n'
        f'<script type="application/json">{data}</script>\n'
        f"<noscript><p>Here is a view that turns; it needs scripts to be allowed.</p></noscript>\n"
        f"<figcaption>{caption}</figcaption>\n</figure>"
    )
