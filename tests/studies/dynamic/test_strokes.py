"""Modes of strokes in the study: learnt once, judged as other models, and bounded on strokes held out."""

from types import SimpleNamespace

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.simple_shapes import box
from palpate.effects.settings import Ball, Contact, Rayleigh
from palpate.models import strokes
from palpate.scenes.settings import Scene
from palpate.stores import stored
from palpate.studies.dynamic import elsewhere
from palpate.studies.dynamic.compared_scene import Compared, ComparedScene
from palpate.studies.dynamic.strokes import Strokes, simulate_strokes

BALL = Ball(name="finger", center_m=[0.03, 0.03, 0.0441], radius_m=0.012)
FINGER = BALL.but(times_s=[0.0, 0.1, 0.2], shifts_m=[[0, 0, 0], [0, 0, -0.008], [0.01, 0, -0.006]])
CONTACT = Contact(friction=0.3, instruments=[FINGER])
STROKED = Scene(name="pad", body="pad", step_s=0.02, duration_s=0.2, contact=CONTACT, rayleigh=Rayleigh())
OWN = {"duration_s": 0.2, "frames": 5, "level": 0}
GRID = {"vibrations": 5, "modes": 30, "states": 20, "thinning": 0.05, "tolerance": 6e-3, "steps_per_frame": [2]}
GRID |= {"half_width_m": 0.022, "strokes": 4}


@pytest.mark.slow
def test_a_region_is_learnt_and_bounded_on_strokes_held_out(tmp_path, monkeypatch):
    monkeypatch.setattr(strokes, "LENGTH_M", 0.01)
    monkeypatch.setattr(strokes, "DEPTHS_M", (0.004, 0.012))
    mesh = box([0.06, 0.06, 0.03], [4, 4, 2])
    body = nest("pad", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] == 0.0), Material(5000.0, 0.3, 1000.0))
    compared = Compared(scene=STROKED, own=OWN)
    region = {"half_width_m": 0.022, "strokes": 4, "seed": 1}
    simulate_strokes(body, SimpleNamespace(strokes=tmp_path / "shown.h5"), compared, region, iter)
    shown = stored(Strokes, tmp_path / "shown.h5")
    assert shown.shown.shape == (4 * 60, len(mesh.nodes) + len(mesh.edges), 3) and shown.seconds > 0.0
    made = ComparedScene.of(STROKED, body, **OWN)
    table = elsewhere.measure_strokes(made, shown, GRID, 3, 1)
    assert list(table["contact"]) == [0, 1, 2]
    found = table[table["failures"] == 0]
    assert len(found) and (found["rmse_of_peak"] < 0.2).all() and (found["estimate_of_peak"] > 0.0).all()
    assert (found["reference_change"] < 0.02).all()
    assert set(found["setting"]) == {"step_s=0.02"}  # as in the scene, whose bound it is
    bounds = elsewhere.motion_bounds([table])
    assert set(bounds["estimate"]) == {"constant", "own"} and (bounds["places"] == 3).all()
    assert bounds["bound_of_peak"].isna().all()  # of fewer than nine strokes there is none

    monkeypatch.setattr(strokes, "DEPTHS_M", (0.022, 0.024))
    flat = elsewhere.stroked(made, strokes.roaming(made.particles(-1), CONTACT, 0.022, 1, 1)[0])
    [row] = elsewhere.measure_stroke(flat, elsewhere.limit_of(flat), None, 0, [2])
    assert "model" not in row  # its elements are turned inside out, so that nothing says how wrong a model is
