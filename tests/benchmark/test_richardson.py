"""Limits of series that are known, over one axis and over several."""

from itertools import product
from typing import NamedTuple

import numpy as np
import pytest

from palpate.benchmark.richardson import CROSS, doubt, estimate, limit, limit_over, number_limits, ratio


@pytest.fixture
def parts():
    """A limit (30, 3) and two shapes of error."""
    return np.random.default_rng(0).normal(size=(3, 30, 3))


@pytest.mark.parametrize("rate", [1.5, 2.0, 2.8, 4.0, 8.0])
def test_a_geometric_series_has_its_limit_and_no_doubt(parts, rate):
    truth, wrong, _ = parts
    levels = np.array([truth + wrong / rate**k for k in range(4)])
    assert ratio(levels) == pytest.approx(rate)  # not clipped, whatever it is
    assert np.allclose(limit(levels), truth) and np.allclose(limit(levels[:3]), truth)
    assert np.abs(doubt(levels)).max() < 1e-12 and np.abs(doubt(levels[:3])).max() < 1e-12


def test_a_diverging_series_shows_in_its_ratio(parts):
    truth, wrong, _ = parts
    assert ratio(np.array([truth, truth + wrong, truth + 3 * wrong])) == pytest.approx(0.5)
    assert np.isnan(ratio(np.array([truth] * 3)))
    assert np.array_equal(limit(np.array([truth] * 3)), truth) and not doubt(np.array([truth] * 3)).any()


@pytest.mark.parametrize("count", [3, 4])
def test_the_doubt_is_about_as_large_as_the_error_of_the_limit(parts, count):
    """Two shapes of error that fall at different rates, as those of an edge and of a smooth part do."""
    truth, edge, smooth = parts
    levels = np.array([truth + edge / 2.6**k + 0.5 * smooth / 5.0**k for k in range(count)])
    error, said = np.linalg.norm(limit(levels) - truth), np.linalg.norm(doubt(levels))
    assert error < said < 6 * error


@pytest.mark.parametrize("rate", [0.9, 1.2, 1.6, 2.0, 3.0])
def test_a_limit_is_the_less_sure_the_lower_its_ratio_is(parts, rate):
    """By what a ratio that is lower by a quarter would change; where none is seen, by what is left at the slowest."""
    truth, wrong, _ = parts
    (found, off), seen = estimate(np.array([truth + wrong / rate**k for k in range(3)])), rate > 1.3
    last = wrong / rate**2
    assert np.allclose(found, truth if seen else truth + last)
    said = 0.25 / (rate - 1.0) if seen else abs(rate - 1.0) / 0.3
    assert np.linalg.norm(off, axis=(1, 2)).max() == pytest.approx(said * np.linalg.norm(last))


@pytest.mark.parametrize("order", [1.0, 2.0, 3.0])
def test_a_number_that_converges_has_its_limit(order):
    levels = 5.0 + 0.3 * 2.0 ** (-order * np.arange(3))
    (limit,), (off,) = number_limits(levels[:, None])
    assert limit == pytest.approx(5.0, rel=1e-12) and off == pytest.approx(levels[2] - 5.0, rel=1e-9)


@pytest.mark.parametrize("levels", [[1.0, 1.1, 1.05], [1.0, 1.1, 1.3], [1.0, 1.0, 1.2]])
def test_a_number_that_does_not_is_as_far_off_as_it_last_changed(levels):
    (limit,), (off,) = number_limits(np.array(levels)[:, None])
    assert limit == levels[2] and off >= abs(levels[2] - levels[1])


class Answer(NamedTuple):
    moved: np.ndarray
    force: float


class Moved(NamedTuple):
    moved: np.ndarray


def made(rates, keys, mixed=0.0):
    """Answers by their keys (i, j, ...), which err by a part for each axis, and by ``mixed`` of what these leave."""
    whole, *parts = np.random.default_rng(0).normal(size=(1 + len(rates), 30, 3))
    left = {key: [rate**-halved for rate, halved in zip(rates, key, strict=True)] for key in keys}
    off = {key: mixed * np.prod(each) for key, each in left.items()}
    moved = {key: whole + np.tensordot(each, parts, 1) + off[key] for key, each in left.items()}
    return {key: Answer(moved[key], 7.0 + sum(each) + off[key]) for key, each in left.items()}, Answer(whole, 7.0)


def away(wrong, truth):
    return np.linalg.norm(wrong.moved - truth.moved), wrong.force - truth.force


@pytest.mark.parametrize("rates", [(2.0,), (2.0, 3.0), (4.0, 2.5, 2.0)])
def test_axes_that_do_not_mix_have_one_limit_and_pairs_of_them_no_doubt(rates):
    count = len(rates)
    answers, truth = made(rates, product(range(3), repeat=count))
    found = limit_over(answers, (1,) * count, (None,) * count)
    assert np.allclose(away(found.answer, truth), 0.0, atol=1e-12)
    assert np.allclose([[each.moved, each.force] for each in found.ratios], np.transpose([rates, rates]))
    own = found.own(away)
    assert own.shape == (count * (count + 1) / 2, 2)
    assert (own[:count] > 1e-3).all() and np.abs(own[count:]).max(initial=0.0) < 1e-12


@pytest.mark.parametrize("rates", [(2.0, 2.0), (3.0, 2.0), (4.0, 4.0)])
def test_what_two_axes_mix_is_covered_by_their_own_error(rates):
    answers, truth = made(rates, CROSS, 0.2)
    found = limit_over(answers, (1, 1), (None, None))
    off, said = np.abs(away(found.answer, truth)), found.own(away)[2]
    assert (off > 1e-3).all() and (off <= said * (1.0 + 1e-9)).all() and (said < 10.0 * off).all()


def test_a_known_ratio_needs_two_members_and_is_as_sure_as_a_longer_line_beside():
    """Steps of order 2, halved once on the second level and twice on the first; or two levels by another's ratio."""
    for more, centre, rates in (([(2, 0), (1, 1), (0, 2)], (1, 0), (None, 4.0)), ([], (0, 0), (3.0, 4.0))):
        answers, truth = made((3.0, 4.0), [(0, 0), (1, 0), (0, 1), *more])
        found = limit_over({key: Moved(each.moved) for key, each in answers.items()}, centre, rates)
        assert np.allclose(found.answer.moved, truth.moved)
        own = found.own(lambda wrong, truth: [np.linalg.norm(wrong.moved - truth.moved)])[:, 0]
        assert own[0] > 1e-2 and (own[1:].max() < 1e-12) == bool(more)
