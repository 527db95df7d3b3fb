"""Every example runs, gives the physical number that it should, and its picture in docs is small."""

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES, PICTURES = ROOT / "examples", ROOT / "docs/examples"
HELPERS = {"draw", "plot", "wind", "hencky"}
"""What the examples import, or name as a file of one's own."""


@pytest.fixture
def example(monkeypatch, tmp_path):
    """Run an example, which writes its picture, and return what its main returns."""
    monkeypatch.syspath_prepend(EXAMPLES)
    monkeypatch.setenv("MPLBACKEND", "agg")

    def run(name: str):
        picture = tmp_path / f"{name}.png"
        found = runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name=name)["main"](picture)
        assert picture.stat().st_size < 60_000
        return found

    return run


@pytest.mark.slow
def test_a_press_moves_the_surface_and_gentle_ones_in_proportion(example):
    peak_m, stiffer = example("press_a_liver")
    assert peak_m == pytest.approx(0.0148, abs=0.0005)
    assert stiffer == pytest.approx(1.27, abs=0.03)  # tissue of this law softens under compression


@pytest.mark.slow
def test_a_cube_falls_for_a_tenth_of_a_second_and_rests_with_its_weight(example):
    landed_s, carried = example("drop_a_cube")
    assert landed_s == pytest.approx((2 * 0.05 / 9.81) ** 0.5, abs=0.005)  # one step
    assert carried == pytest.approx(1.0, abs=1e-4)


@pytest.mark.slow
def test_a_beam_creeps_and_returns_as_the_standard_linear_solid(example):
    assert example("creeping_beam") < 0.01


@pytest.mark.slow
def test_two_spheres_cross_in_a_circle(example):
    pairs, length = example("crossing_pairs")
    assert 100 < pairs < 200
    assert 0.985 < length < 1.0  # the polyhedra lie inside the spheres


@pytest.mark.slow
def test_springs_follow_finite_elements_after_the_fit(example):
    before, after = example("fit_springs")
    assert before > 0.2 and after < 0.06


@pytest.mark.slow
def test_a_body_from_a_ct_has_the_volume_of_the_organ(example):
    volume, overlap = example("body_from_ct")
    assert volume == pytest.approx(1.0, abs=0.01)
    assert overlap > 0.99


@pytest.mark.slow
def test_a_banner_hangs_along_weight_and_wind(example):
    assert example("banner_in_wind") == pytest.approx(1.0, abs=0.01)


@pytest.mark.slow
def test_models_are_compared_at_contacts_that_they_have_not_seen(example):
    errors = example("compare_models")
    assert list(errors.values()) == sorted(errors.values(), reverse=True)
    assert max(errors.values()) > 10 and errors["corrected coarse FEM"] < 1.5  # % of the peak


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_examples_are_short_tested_and_shown(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 40
    if path.stem in HELPERS:
        return
    assert f'example("{path.stem}")' in Path(__file__).read_text(encoding="utf-8")
    assert (PICTURES / f"{path.stem}.png").stat().st_size < 60_000
    pages = [page.read_text(encoding="utf-8") for page in (ROOT / "README.md", *(ROOT / "docs").glob("*.md"))]
    assert any(f"examples/{path.stem}.png" in page and f"examples/{path.stem}.py" in page for page in pages)
