"""What facets change: against the stiffness of a bent bar of twelve sides and of a round one, from either of them."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark import truth as truth_of_presses
from palpate.benchmark.accuracy import OWN, Truth, truth_levels
from palpate.benchmark.load import Load
from palpate.benchmark.presses import Sample
from palpate.benchmark.truth import ascend
from palpate.bodies.organs import SmoothSurface
from palpate.bodies.refinement import finer
from palpate.errors import NotConverged
from palpate.studies.tradeoff.truth_table import GEOMETRY_COLUMNS, geometry_share, truth_table

ROUND = SmoothSurface("cylinder", 0.03)
SIDES = 12
SECOND_MOMENTS = SIDES / 24 * np.sin(2 * np.pi / SIDES) * (2 + np.cos(2 * np.pi / SIDES)) / (np.pi / 4)
"""That of a regular polygon over that of the circle around it."""


@pytest.fixture(scope="module")
def loads(beam):
    """A force on the bar's side, near its free end, across it."""
    contact = int(np.argmax(beam.coarse.nodes @ [1.0, 0.0, 1.0] - np.abs(beam.coarse.nodes[:, 2] - 0.18)))
    return [Sample(4, Load.at(contact, np.array([-0.002, 0.0, 0.0])), 0.02)]


def truth_on_level_1(body, loads):
    """A truth that has nothing but the answer of level 1."""
    answers, _ = ascend(body, loads, [range(1, 2)], 1e-4)
    moved = np.array([each.surface[0] for each in answers])
    levels = np.stack([np.full_like(moved, np.nan), moved, np.full_like(moved, np.nan)], axis=1)
    one, nothing = np.ones(len(moved)), np.zeros((len(moved), len(OWN)))
    whole = dict.fromkeys(("ratio", "least_det", "volume_change", "iterations", "products", "seconds"), one)
    rejected = np.array([""] * len(moved), dtype=object)
    known = np.array([sample.number for sample in loads]), moved, levels
    return Truth(*known, own=nothing, rejected=rejected, radius_m=0.02, level=1, elements=1, nodes=1, **whole)


def test_facets_bend_more_by_what_their_section_lacks(beam, loads):
    truth = truth_on_level_1(beam, loads)
    share = geometry_share(beam, ROUND, loads, truth, [4])
    assert share.columns.tolist() == GEOMETRY_COLUMNS and share["sample"].tolist() == [4]
    assert share["seconds"].item() > 0
    assert share["relative_l2"].item() == pytest.approx(1.0 - SECOND_MOMENTS, rel=0.06)
    [row] = truth_table({"beam_large": truth}, None, {"beam_large": share}).itertuples()
    assert row.geometry_of_peak == share["rmse_of_peak"].item() and row.geometry_samples == 1
    assert row.geometry_patch_of_peak == share["patch_rms_of_peak"].item()
    assert np.isnan(truth_table({"beam_large": truth})["geometry_of_peak"].item())


def test_samples_are_spread_over_those_that_are_believed(beam, loads):
    truth = truth_on_level_1(beam, loads)
    many = replace(truth, sample=np.arange(9), rejected=np.array(["", "", "why"] * 3, dtype=object))
    assert many.spread(3).tolist() == [0, 3, 7] and many.spread(0).tolist() == []
    assert many.spread(20).tolist() == [0, 1, 3, 4, 6, 7]


def test_every_level_of_a_smooth_body_leads_to_its_truth(beam):
    smooth = finer(replace(beam.up_to(0), smooth=ROUND), 2)
    assert truth_levels(smooth) == range(0, 4) and truth_levels(replace(smooth, smooth=None)) == range(2, 5)


@pytest.mark.slow
def test_it_is_the_same_from_the_smooth_body(beam, loads):
    smooth = finer(replace(beam.up_to(0), smooth=ROUND))
    there = geometry_share(smooth, ROUND, loads, truth_on_level_1(smooth, loads), [4])
    back = geometry_share(beam, ROUND, loads, truth_on_level_1(beam, loads), [4])
    assert there["rmse_m"].item() == pytest.approx(back["rmse_m"].item(), rel=1e-3)


def test_a_press_without_an_answer_has_no_row(beam, loads, monkeypatch):
    truth = truth_on_level_1(beam, loads)

    def fail(*arguments, **options):
        raise NotConverged("it does not", [1.0])

    monkeypatch.setattr(truth_of_presses._Level, "settle", fail)
    assert geometry_share(beam, ROUND, loads, truth, [4]).empty
