"""Give what every page carries with it: its style sheet and its script."""

import base64
from html import escape
from importlib.resources import files

_SCRIPTS = ("unpack", "sort", "place", "pane", "program", "surface", "turn", "play")
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
"""What a browser lets the page do: nothing over the network."""


def document(title: str, style: str, body: str, policy: str = POLICY, more: str = "") -> str:
    """Return a page of HTML; title : plain text; more : HTML that its head has besides."""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"{more}<title>palpate: {escape(title)}</title>\n<style>{style}</style>\n</head>\n<body>\n"
        f"{body}</body>\n</html>\n"
    )


def style() -> str:
    """Return the style sheet: plain, readable, light and dark."""
    return asset("page.css")


def script() -> str:
    """Return the script, in a scope of its own: sorting, the mark of the place, large figures, views that turn."""
    return '(() => {\n"use strict";\n' + "\n".join(asset(f"{name}.js") for name in _SCRIPTS) + "})();\n"


def asset(name: str, package: str = "palpate.report") -> str:
    """Return an asset of a package; those of this one pages share."""
    return (files(package) / "assets" / name).read_text(encoding="utf-8")


def base64_of(data: bytes) -> str:
    """Return bytes as a page holds them."""
    return base64.b64encode(data).decode("ascii")
