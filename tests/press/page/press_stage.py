"""What tests ask of a page on which a body is pressed."""

import numpy as np
from report import browser as chromium

STAGE = "document.querySelector('figure.press').stage"
READY = f"{STAGE}?.main && {STAGE}.panel.canvas.width > 310"
RESTING = f"!{STAGE}.stale && !{STAGE}.busy && {STAGE}.waiting === null"
NOW = f"""(() => {{ const s = {STAGE}; return {{
  presses: s.pressing.map((finger) => finger.press), displacement: [...s.main.answer.displacement],
  forces: [...s.main.answer.forces], places: [...s.main.places], nodes: [...s.main.surface.nodes] }}; }})()"""
CLOSE = 1e-4
"""Of the peak: what displacements may differ by in float32."""


def rest(page):
    chromium.until(page, RESTING)
    return page.evaluate(NOW)


def spots(page, count):
    """Pixels of the page under which the body lies, far from its outline, and from what is held."""
    return page.evaluate(
        f"""count => {{
        const s = {STAGE}, {{ nodes, triangles }} = s.main.surface, found = [];
        const {{ left, top, width, height }} = s.panel.canvas.getBoundingClientRect();
        for (let i = 0; found.length < count && i < 4000; i++) {{
          const x = width * (0.35 + 0.4 * ((i * 0.7548) % 1)), y = height * (0.25 + 0.5 * ((i * 0.5698) % 1));
          const at = ([dx, dy]) => s.camera.pick(nodes, triangles, x + dx, y + dy, width, height);
          if ([[0, 0], [25, 0], [-25, 0], [0, 25], [0, -25]].every(at)) found.push([left + x, top + y]);
        }}
        return found; }}""",
        count,
    )


def same(found, answer):
    """Whether what is shown is what Python answers; the answer."""
    expected = answer.respond(found["presses"])
    peak = np.linalg.norm(expected.displacement, axis=1).max()
    assert peak > 1e-4
    shown = np.reshape(found["displacement"], (-1, 3))
    assert np.abs(shown - expected.displacement).max() < CLOSE * peak
    moved = np.reshape(found["places"], (-1, 3)) - np.reshape(found["nodes"], (-1, 3))
    assert np.abs(moved - expected.displacement).max() < CLOSE * peak + 1e-7
    np.testing.assert_allclose(
        np.reshape(found["forces"], (-1, 3)), expected.forces, atol=1e-3 * np.abs(expected.forces).max()
    )
    return expected
