"""Bad input ends the real command with exit code 1, one sentence, no traceback and no output."""

from pathlib import Path

import numpy as np
import pytest
from fixtures.mesh_encodings import SURFACES

SHARED = Path(__file__).parents[2].parent / "shared"


@pytest.fixture
def refused(run, smoke, write_config, tmp_path):
    """Run with changed settings towards a body, and return what the refusal printed."""

    def printed(**changes) -> str:
        settings = {"bodies": {"liver": smoke["bodies"]["liver"] | changes}, "enrichment": None}
        if "path" in changes:
            settings["bodies"]["liver"] |= {"kind": "file", "scale_m": 1.0}
            del settings["bodies"]["liver"]["length_m"]
        target = "results/data/liver/body.h5"
        done = run(tmp_path, write_config(settings), "--", target)
        assert done.returncode == 1
        assert "Traceback" not in done.stdout
        assert done.stdout.count("error: ") == 1
        assert not (tmp_path / target).exists()
        return done.stdout

    return printed


def test_unknown_key(refused):
    assert "error: config.yaml: bodies.liver has an unknown key poison; did you mean poisson?\n" in refused(poison=0.3)


@pytest.mark.slow
def test_surface_with_a_hole(refused, tmp_path):
    corners, three_of_four = np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3]])
    (tmp_path / "hole.stl").write_bytes(SURFACES["ascii.stl"](corners, three_of_four, ""))
    printed = refused(path="hole.stl")
    (sentence,) = [line for line in printed.splitlines() if "error: " in line]
    assert "hole.stl" in sentence
    assert "results/logs/liver/make_body.log" in printed


@pytest.mark.slow
@pytest.mark.skipif(not SHARED.is_dir(), reason="no shared meshes")
def test_infinite_coordinate(refused):
    broken = SHARED / "meshes/broken/liver_for_test_broken.vtk"
    assert broken.name in refused(path=str(broken))
