"""The page on which a reader presses a body, for the report and as a document of its own."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from palpate.bodies.body import Body
from palpate.files import write_whole
from palpate.press.portable.file import FOUR_ERRORS
from palpate.report import page_assets
from palpate.report.page_assets import base64_of
from palpate.report.words import percent, seconds, spaced

_SCRIPTS = (
    *("camera", "light", "arrow", "painter", "coarse", "answers", "finger", "view"),
    *("panel", "stage", "tool", "pace", "gestures", "knife", "readings"),
)
_COLOURS = {"displacement": "YlGnBu", "error": "YlOrRd"}  # as in all other pictures
_SHADES = 254
_WHOLE = 32767  # of a truth's numbers: 0.003 % of its peak, far below the truth's own error


@dataclass(frozen=True, eq=False)
class Known:
    """A press and its truth.

    contact : coarse node; place : its triangle of the fine surface, and the weights of its corners
    force : (3,) [N]; displacement : (n, 3) [m] of the fine surface; own : the truth's own error, RMSE over peak
    """

    contact: int
    place: dict
    force: np.ndarray
    displacement: np.ndarray
    own: float

    @property
    def press(self) -> dict:
        """The press as portable models take it."""
        return self.place | {"force": [float(part) for part in self.force]}


@dataclass(frozen=True, eq=False)
class PressModel:
    """A model that a reader may let answer: its ``file``, or the ``url`` of a server that asks it.

    knife : the ``url`` of a server that lets a knife cut it, if it follows one
    kind : "portable", or "coarse" for a file of palpate.press.coarse_rival
    advice : a sentence on its error and time
    nodes, triangles, info : (n, 3) [m], (t, 3) and the words of a file's header, of a model
        behind a ``url``; of one in a file SCALES alone
    """

    name: str
    title: str
    file: bytes | None = None
    url: str | None = None
    advice: str = ""
    truths: Sequence[Known] = ()
    nodes: np.ndarray | None = None
    triangles: np.ndarray | None = None
    info: Mapping = field(default_factory=dict)
    kind: str = "portable"
    knife: str | None = None


def press_section(
    models: Sequence[PressModel], caption: str = "", name: str = "it", held: Sequence[bool] | np.ndarray = ()
) -> str:
    """Return HTML to press the body of ``models``; the first of them answers until another is chosen.

    caption : HTML below it; name : of the body, where a page has several
    held : of its n nodes, whether they are held; they are hatched
    """
    head = {"models": [_head(model) for model in models], "palettes": {k: _palette(v) for k, v in _COLOURS.items()}}
    head["held"] = base64_of(np.asarray(held, np.uint8).tobytes())
    head_json = json.dumps(head, separators=(",", ":")).replace("<", "\\u003c")
    packed = "".join(
        f'<script type="text/plain" data-model="{escape(model.name)}">{base64_of(model.file)}</script>\n'
        for model in models
        if model.file is not None
    )
    return (
        f"<style>{_asset('press.css')}</style>\n"
        f'<figure class="press" id="press_{escape(name)}">\n'
        f'<script class="head" type="application/json">{head_json}</script>\n'
        f"{packed}<noscript><p>Here a body can be pressed; it needs scripts to be allowed.</p></noscript>\n"
        f"<figcaption>{caption}</figcaption>\n</figure>\n<script>{_script(models)}</script>\n"
    )


def press_document(
    models: Sequence[PressModel], title: str = "Press it", held: Sequence[bool] | np.ndarray = ()
) -> str:
    """Return a whole page to press the body of ``models``, which needs no other file and explains the errors it says.

    title : plain text; held : of ``press_section``
    """
    style = page_assets.style() + _asset("document.css")
    contact_modes = any(model.kind == "portable" and model.file is not None for model in models)
    explained = f"<p>{escape(' '.join(FOUR_ERRORS))}</p>" if contact_modes else ""
    section = press_section(models, explained, held=held)
    body = f'<main>\n<p class="name">palpate</p>\n<h1>{escape(title)}</h1>\n{section}</main>\n'
    icon = '<link rel="icon" href="data:,">\n'  # or a browser asks the server for one
    return page_assets.document(title, style, body, policy(models), icon)


def write_pages(
    models: Sequence[PressModel], name: str, held: Sequence[bool] | np.ndarray, section: Path | str, page: Path | str
) -> None:
    """Write the ``section`` of the report and the whole ``page`` on which the body ``name`` is pressed."""
    whole = press_document(models, f"Press it: {spaced(name)}", held)
    for path, text in ((section, press_section(models, name=name, held=held)), (page, whole)):
        with write_whole(path) as part:
            part.write_text(text, encoding="utf-8")


def policy(models: Sequence[PressModel]) -> str:
    """Return the page's content security policy: no network but, for models that need it, the page's own server."""
    asks = any(model.url is not None for model in models)
    return page_assets.POLICY + ("; connect-src 'self'" if asks else "")


def _head(model: PressModel) -> dict:
    """Describe a model to the page."""
    head: dict = {"name": model.name, "title": model.title, "advice": model.advice, "kind": model.kind}
    head["info"] = dict(model.info)
    head["truths"] = [_truth(truth) for truth in model.truths]
    if model.url is not None:
        if model.nodes is None or model.triangles is None:
            raise ValueError(f"{model.name}: a model behind a url needs nodes and triangles")
        head |= {"url": model.url, "knife": model.knife}
        head["nodes"] = base64_of(np.asarray(model.nodes, "<f4").tobytes())
        head["triangles"] = base64_of(np.asarray(model.triangles, "<u4").tobytes())
    return head


def _truth(known: Known) -> dict:
    """Describe a press of known truth to the page, with its displacements as 16-bit multiples of a step [m]."""
    moved = np.asarray(known.displacement, float)
    newtons, peak = float(np.linalg.norm(known.force)), float(np.linalg.norm(moved, axis=1).max())
    step = float(np.abs(moved).max()) / _WHOLE
    return {
        "title": f"place {known.contact}: {newtons:.2g} N, moves {1e3 * peak:.0f} mm",
        "note": "The truth is the limit of ever finer quadratic elements; "
        f"its own error is {percent(known.own)} of its peak.",
        **known.press,
        "peak": peak,
        "step": step,
        "packed": base64_of(np.round(moved / step).astype("<i2").tobytes()),
    }


def _palette(name: str) -> str:
    """Return a colour map as bytes, three for each of 254 shades."""
    import matplotlib

    colours = matplotlib.colormaps[name](np.linspace(0, 1, _SHADES))[:, :3]
    return base64_of(np.round(255 * colours).astype(np.uint8).tobytes())


def _script(models: Sequence[PressModel]) -> str:
    """Return the page's script, in a scope of its own, with the runtime of models whose file lies in the page."""
    runtime = ""
    if any(model.file is not None and model.kind == "portable" for model in models):
        runtime = (files("palpate.press.portable") / "runtimes" / "palpate.js").read_text(encoding="utf-8")
    scripts = page_assets.asset("program.js") + "\n".join(_asset(f"{name}.js") for name in _SCRIPTS)
    return f'(() => {{\n"use strict";\n{runtime}\n{scripts}}})();\n'


def _asset(name: str) -> str:
    return page_assets.asset(name, "palpate.press.page")


TITLES = {"contact_modes": "contact modes", "coarse": "linear, coarse mesh"}
"""The models' names on the page."""
ABOUT = {
    "contact_modes": "Quadratic elements, reduced to shapes of presses.",
    "coarse": "Linear elements of the coarse mesh under small strains, as in a game.",
}
SCALES = ("peak_m", "hardest_n")
"""Displacement and force of a full press, which scale colours, arrows and depths of the page."""


def model_in_page(
    name: str, file: bytes, info: Mapping, measured: Any = None, truths: Sequence[Known] = ()
) -> PressModel:
    """Return the model ``name`` of ABOUT, whose ``file`` lies in the page.

    info : has SCALES; measured : its row of the table press, or None; truths : presses that the page can show
    """
    advice = ABOUT[name] if measured is None else f"{ABOUT[name]} {worth(measured)}"
    scales = {key: info[key] for key in SCALES}
    kind = "coarse" if name == "coarse" else "portable"
    return PressModel(name, TITLES[name], file, advice=advice, truths=truths, info=scales, kind=kind)


def held_nodes(body: Body) -> np.ndarray:
    """Return (n,), whether each node of the fine surface is held."""
    return np.isin(body.fine.surface, body.anchors[-1])


def worth(row: Any) -> str:
    """Return error and time of a row of the table press as a sentence."""
    time = f"an answer takes {seconds(row.online_median_s)} in Python"
    if not row.samples:
        return f"Here {time}."
    basis = f"{row.samples} presses whose truth was simulated"
    error = f"Error {percent(row.rmse_of_peak)} of the peak, {percent(row.rmse_of_peak_most)} at most, on {basis}"
    return f"{error}; {time}."
