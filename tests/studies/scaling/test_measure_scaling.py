"""What grows is measured at the sizes asked for, and its powers are found."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from palpate.studies.scaling import measure_scaling
from palpate.studies.scaling.measure_scaling import COMPONENTS, FITTED_SIZES, Meter, exponents, measure

pytestmark = pytest.mark.slow

SIZES = {
    "fem": [1, 2],
    "fine_nodes": [200, 400],
    "samples": [20, 40],
    "triangles": [400, 1600],
    "particles": [200, 800],
}
STAGES = {
    "fem": ["mesh", "set up", "linearise", "respond"],
    "fine_nodes": ["paper 1: prepare", "paper 1: query", "detail correction: prepare", "detail correction: query"],
    "samples": ["paper 1: prepare", "paper 1: query"],
    "triangles": ["build", "refit", "query"],
    "particles": ["set up", "step"],
    "cores": ["generation"],
}


@pytest.mark.parametrize("component", COMPONENTS)
def test_every_component_runs_at_its_sizes(component, monkeypatch):
    monkeypatch.setattr(measure_scaling, "LONG_S", 0.01)  # how well it is timed does not matter here
    table = measure(component, SIZES.get(component, [1]))
    assert list(dict.fromkeys(table["stage"])) == STAGES[component]
    assert len(table) == len(STAGES[component]) * len(SIZES.get(component, [1]))
    assert (table["seconds"] > 0).all() and (table["memory_mb"] >= 0).all()
    if component == "fem":
        assert list(table["size"].unique()) == [628 * 8, 628 * 64]
    elif component in SIZES:
        assert np.allclose(table["size"].unique(), SIZES[component], rtol=0.1)


@pytest.mark.parametrize("refinements", [0, 1])
def test_the_press_moves_the_coarse_body_as_far_as_was_asked(refinements):
    """On the coarse mesh by the peak that was asked for but for the nonlinearity; on a finer one in equilibrium."""
    found = {}

    class Keep:
        def once(self, stage, call, *given):
            found[stage] = call, given, call(*given)
            return found[stage][-1]

        often = once

    measure_scaling.fem(refinements, Keep())
    body, (solve, (load, _), solution) = found["mesh"][-1], found["respond"]
    moved = np.linalg.norm(solution.x - body.fine.nodes, axis=1).max()
    if refinements == 0:
        assert moved == pytest.approx(measure_scaling.PEAK_OF_SIZE * body.fine.size, rel=0.03)
    assert solution.history[-1] <= measure_scaling.TOLERANCE
    left = solve.__self__.force(solution.x)
    assert np.linalg.norm(left) <= 1.01 * measure_scaling.TOLERANCE * np.linalg.norm(load)


def test_a_meter_sees_what_a_call_takes():
    if not Path("/proc/self/clear_refs").exists():
        pytest.skip("this system does not report the peak of resident memory")
    meter = Meter()
    meter.once("large", lambda: np.ones(25_000_000).sum())
    meter.once("small", lambda: np.ones(10).sum())
    large, small = (stage["memory_mb"] for stage in meter.stages)
    assert 190 < large < 260
    assert small < 60


def test_exponents_are_those_of_the_largest_sizes():
    sizes = np.array([10, 100, 1000, 10_000, 100_000])
    seconds = 1e-6 * sizes**1.5
    seconds[0] = 1.0  # an overhead that only the smallest sizes show
    table = pd.DataFrame({"component": "k", "stage": "s", "size": sizes, "seconds": seconds, "memory_mb": 1e-2 * sizes})
    found = exponents(table).iloc[0]
    assert FITTED_SIZES == 4
    assert found["seconds_exponent"] == pytest.approx(1.5)
    assert found["memory_exponent"] == pytest.approx(1.0)  # of 10 MB on
    assert np.isnan(exponents(table[:1])["seconds_exponent"].iloc[0])
