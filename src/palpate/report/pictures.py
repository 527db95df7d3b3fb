"""Pictures and views that turn, as self-contained HTML."""

import base64
from html import escape
from io import BytesIO
from pathlib import Path

from palpate.files import require_file

_SVG_BYTES = 200_000
_QUALITY = 88  # of pictures that are too large as SVG: a fifth of a PNG's bytes, and no difference to be seen


def image(stem: Path, alt: str) -> str:
    """``stem``.svg if it is small, else ``stem``.png as WebP, as an ``img`` with its data inside.

    Raises InputError if the figure is missing.
    """
    vector, raster = (require_file(stem.with_name(f"{stem.name}.{suffix}")) for suffix in ("svg", "png"))
    if vector.stat().st_size <= _SVG_BYTES:
        kind, data = "svg+xml", vector.read_bytes()
    else:
        kind, data = "webp", _webp(raster)
    return f'<img alt="{escape(alt)}" src="data:image/{kind};base64,{base64.b64encode(data).decode()}">'


def _webp(path: Path) -> bytes:
    """A picture in WebP; the same picture gives the same bytes."""
    from PIL import Image

    file = BytesIO()
    Image.open(path).convert("RGB").save(file, "WEBP", quality=_QUALITY, method=4)
    return file.getvalue()


def figure(folder: Path, name: str, caption: str) -> str:
    """A picture with its caption (HTML) and a link to the file."""
    picture = image(folder / name, name.replace("_", " "))
    return (
        f'<figure id="{name}">\n<a href="figures/{name}.svg">{picture}</a>\n'
        f"<figcaption>{caption}</figcaption>\n</figure>"
    )


def turnable(folder: Path, name: str, title: str, caption: str) -> str:
    """The surface in ``name``.json, to be turned, under its title, with its caption (HTML).

    Raises InputError if it is missing.
    """
    data = require_file(folder / f"{name}.json").read_text(encoding="ascii").replace("<", "\\u003c")
    return (
        f'<figure class="turn" id="turn_{name}" data-title="{escape(title)}">\n'
        f'<script type="application/json">{data}</script>\n'
        f"<noscript><p>A view to turn stands here where scripts are allowed.</p></noscript>\n"
        f"<figcaption>{caption}</figcaption>\n</figure>"
    )
