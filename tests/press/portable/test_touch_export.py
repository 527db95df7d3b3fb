"""Places that are prepared for a file answer as the reduced models and the elements that they are made of."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fixtures.touched_pad import *  # noqa: F403
from fixtures.touched_pad import BALL

from palpate.effects.instrument import Instrument
from palpate.effects.law import PLAIN
from palpate.errors import InputError
from palpate.models.touch.reduced_touch import settle_touching
from palpate.press.portable.runtimes.palpate_model import settle_touch, touch_kernel
from palpate.press.portable.touches import Touches, measured, prepare_places


@pytest.fixture(scope="module")
def prepared(pad):
    return prepare_places(pad, Touches([BALL], 1, 0.3, 2), 1)


@pytest.mark.slow
def test_a_place_answers_as_its_elements_between_the_pushes_it_is_made_of(prepared, pad):
    (place,), trials = prepared
    for trial in trials:
        way = trial.touch.direction
        q = touch_kernel(place.pushed, place.axes @ way * trial.touch.depth_m / place.deepest_m) @ place.starts
        tip = trial.touch.pose(pad).tip + trial.touch.depth_m * way
        q, force, _, left = settle_touch(place, tip, q)
        apart = np.sqrt(np.mean(np.sum(((place.surface @ q).reshape(-1, 3) - trial.displacement) ** 2, axis=1)))
        assert left < 1e-5 and apart < 0.01 * np.linalg.norm(trial.displacement, axis=1).max()
        assert force @ way == pytest.approx(trial.force_n, rel=0.05)
        # the same minimum as the compiled kernel of the reduced models finds
        body = *(each[None] for each in (place.slopes, place.volumes, place.mu, place.lam)), place.rest, *PLAIN
        points, other = (place.points, place.moves, place.areas, place.penalty), q + 1e-3 * np.abs(q).max()
        settle_touching(other, body, place.firm, points, tip, place.axes, BALL.shape, 1e-8, 60)
        assert place.surface @ other == pytest.approx(place.surface @ q, abs=1e-6 * np.abs(place.surface @ q).max())


@pytest.mark.slow
@pytest.mark.parametrize(("off", "kept"), [(1.05, 1), (1.5, 0)])
def test_a_place_that_is_answered_wrongly_is_left(prepared, off, kept):
    places, trials = prepared
    asked = iter(trials)

    class Off:
        """A file that answers the trials, in turn, too largely."""

        def touch(self, number, depth_m, direction):
            trial = next(asked)
            return SimpleNamespace(displacement=off * trial.displacement, force_n=off * trial.force_n)

    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = measured(Off(), places, trials)
    assert len(found) == kept and len(said) == 1 - kept
    assert all(place.force_error == pytest.approx(off - 1.0) for place in found)


def test_instruments_that_a_file_cannot_hold_are_refused(pad):
    for wrong in (Instrument("capsule", 0.01, length_m=0.01), replace(BALL, sticks=True)):
        with pytest.raises(InputError, match="sphere or a punch"):
            prepare_places(pad, Touches([wrong], 1), 1)
    with pytest.raises(InputError, match="half the ball"):
        prepare_places(pad, Touches([BALL], 1, 1.2), 1)
