"""A ball on a cube converges to Hertz's law; tests/benchmarks/hertz.py goes on with finer meshes."""

import runpy
from pathlib import Path

HERTZ = runpy.run_path(str(Path(__file__).parents[1] / "benchmarks/hertz.py"))


def test_the_error_halves_with_the_mesh():
    coarse, fine = (HERTZ["pressed"](cells, 40.0, 2.0, 0.01)[-1] - 1.0 for cells in (1, 2))
    assert 0.0 < fine < 0.55 * coarse < 0.3


def test_a_wide_gap_presses_early_by_as_much_as_it_is_wide():
    """The gap changes the force as much as the same additional depth does."""
    narrow, wide = (HERTZ["pressed"](1, 30.0, 2.5, gap)[-1] for gap in (0.01, 0.2))
    assert 1.15**1.5 < wide / narrow < 1.2**1.5
