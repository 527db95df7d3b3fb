"""Give what every page carries with it: its style sheet and its script."""

from importlib.resources import files

_SCRIPTS = ("unpack", "sort", "place", "pane", "program", "surface", "turn", "play")
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
"""What a browser lets the page do: nothing over the network."""


def style() -> str:
    """Return the style sheet: plain, readable, light and dark."""
    return asset("page.css")


def script() -> str:
    """Return the script, in a scope of its own: sorting, the mark of the place, large figures, views that turn."""
    return '(() => {\n"use strict";\n' + "\n".join(asset(f"{name}.js") for name in _SCRIPTS) + "})();\n"


def asset(name: str) -> str:
    """Return an asset that pages share."""
    return (files("palpate.report") / "assets" / name).read_text(encoding="utf-8")
