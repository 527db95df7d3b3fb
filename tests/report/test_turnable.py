"""What the page's script unpacks is the surface that was packed, and it stays small."""

import base64
import json
import zlib

import numpy as np
import pytest
from matplotlib.colors import Normalize

from palpate.report import render, turnable
from palpate.scenes.motion import Motion, Moved
from palpate.studies.enrichment.figures import bodies
from palpate.studies.scenes import motion_pictures as drawn_motion


def unpacked(path):
    """A view as the script sees it: head, positions (f, n, 3) [m], triangles (m, 3), shades (f, n)."""
    head = json.loads(path.read_text())
    frames, vertices, triangles = head["counts"]
    data = zlib.decompress(base64.b64decode(head["packed"]))
    sizes = np.array([frames * vertices * 3 * 2, triangles * 3 * 4, frames * vertices])
    assert len(data) == sizes.sum()
    places, corners, shades = (
        np.frombuffer(part, np.uint8) for part in np.split(np.frombuffer(data, np.uint8), np.cumsum(sizes)[:-1])
    )
    changes = places.reshape(2, -1).T.copy().view("<i2").reshape(vertices, 3, frames)
    moved = np.cumsum(changes, axis=2, dtype=np.int64) % 2**16
    positions = np.array(head["origin"]) + head["step"] * np.moveaxis(moved, 2, 0)
    corners = corners.reshape(4, -1).T.copy().view("<u4").reshape(-1, 3)
    shades = np.cumsum(shades.reshape(vertices, frames), axis=1, dtype=np.int64).T % 256
    return head, positions, corners, shades


def test_a_motion_comes_back(sagging, tmp_path):
    path = tmp_path / "sag.json"
    drawn_motion.write(sagging, path)
    head, positions, triangles, shades = unpacked(path)
    surface = np.unique(sagging.triangles)
    assert np.abs(positions - sagging.positions[:, surface]).max() < 0.51 * head["step"]
    np.testing.assert_array_equal(surface[triangles], sagging.triangles)
    np.testing.assert_allclose(head["frames"]["times_s"], sagging.times, atol=1e-6)
    assert head["frames"]["start"] == 15  # the peak
    free = ~np.isin(surface, sagging.held)
    assert (shades[:, ~free] == turnable.HELD).all() and (shades[0, free] == 0).all()
    tip = np.argmax(np.linalg.norm(sagging.positions[15] - sagging.rest, axis=1)[surface])
    assert shades[15, tip] == 253  # the last colour


def test_rigid_things_stand_beside_the_body(sagging, tmp_path):
    where = np.linspace([0.1, 0.1, 0.0], [0.1, 0.05, 0.0], 31)[:, None]
    ball = Moved("finger", "sphere", 0.02, where, np.zeros((0, 3), int))
    ends = np.repeat(np.array([[[0.0, 0.1, 0.0], [0.05, 0.1, 0.0]]]), 31, axis=0)
    rod = Moved("rod", "capsule", 0.01, ends, np.zeros((0, 3), int))
    names = ("times", "positions", "rest", "triangles", "tetrahedra", "held", "energy")
    motion = Motion("poke", *(getattr(sagging, name) for name in names), (ball, rod))
    path = tmp_path / "poke.json"
    drawn_motion.write(motion, path)
    head, positions, triangles, shades = unpacked(path)
    body = len(np.unique(sagging.triangles))
    assert head["bare"] == len(sagging.triangles) < len(triangles)
    assert triangles[: head["bare"]].max() == body - 1 < triangles[head["bare"] :].min()
    assert (shades[:, body:] == turnable.THING).all()
    distance = np.linalg.norm(positions[:, body:] - where, axis=2)
    on_ball = np.isclose(distance, 0.02, atol=1e-4).all(axis=0)
    assert on_ball.sum() > 100 and not on_ball.all()


def test_errors_come_back_with_their_sample(database, predictions_file, tmp_path):
    shown = bodies.read(predictions_file, "paper", "samples", bodies.JUDGED)
    path = tmp_path / "errors.json"
    bodies.write(database, shown, path)
    head, positions, triangles, shades = unpacked(path)
    choices = head["frames"]["choices"]
    assert [len(options) for options in choices.values()] == [3, 3] and len(positions) == 9
    np.testing.assert_array_equal(triangles, database.triangles)
    # conftest: a prediction is the more wrong the later the sample; of ours the worst is sample 7
    assert head["frames"]["notes"][8].startswith("sample 7: ")
    right = database.nodes_fine_surface + database.fine[7]
    assert np.abs(positions[8] - right).max() < 1e-5
    at_peak = np.argmax(np.linalg.norm(database.fine[7], axis=1))
    assert shades[8, at_peak] == shades[8].max() < shades[5].max()


def test_a_large_motion_loses_frames_and_not_its_ends(tmp_path):
    rng = np.random.default_rng(0)
    positions = rng.uniform(size=(60, 6000, 3))
    times, norm = np.linspace(0, 2, 60).tolist(), Normalize(0, 1)
    view, triangles = render.View(np.eye(3), np.zeros(3), 1.0, 1.0), np.arange(6000).reshape(-1, 3)
    shades, legend = turnable.shades(positions[..., 0], norm), turnable.legend("", norm, "YlOrRd")
    large = turnable.Turnable(view, positions, triangles, shades, 2000, legend, {"times_s": times, "start": 30})
    turnable.write(large, tmp_path / "large.json")
    head, found, _, _ = unpacked(tmp_path / "large.json")
    kept = head["frames"]["times_s"]
    assert (tmp_path / "large.json").stat().st_size < turnable._BYTES or len(kept) == turnable._FRAMES[-1]
    assert kept[0] == 0 and kept[-1] == 2 and len(kept) == len(found) < 60
    nearest = np.abs(np.array(kept) - times[30]).min()
    assert abs(kept[head["frames"]["start"]] - times[30]) == pytest.approx(nearest)
