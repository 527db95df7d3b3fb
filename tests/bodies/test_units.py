"""The unit of a mesh file is guessed from the size, and a given one is checked against it."""

import warnings

import numpy as np
import pytest

from palpate.bodies.mesh_file import choose_scale, guess_scale, in_words
from palpate.errors import InputError


def box(size):
    return np.array([[0, 0, 0], [size, size / 2, size / 3]])


@pytest.mark.parametrize(
    ("size", "scale"), [(200, 1e-3), (35, 1e-3), (12, 1e-2), (0.2, 1.0), (2e5, 1e-6), (1.0, None), (5000, None)]
)
def test_the_unit_is_one_that_makes_an_organ(size, scale):
    guess = guess_scale(size)
    assert (guess[1] if guess else None) == scale


def test_a_guess_is_said_with_the_size():
    with pytest.warns(UserWarning, match=r"^a: scale_m is not given; .* for the millimetre, .* 82 mm long"):
        assert choose_scale("a", box(82), None) == 1e-3


def test_a_size_of_no_unit_asks_for_it():
    with pytest.raises(InputError, match=r"is 1 units, .*give scale_m, .* \(0\.2 makes it 20 cm long\)\.$"):
        choose_scale("a", box(1), None)


@pytest.mark.parametrize(
    ("size", "given", "message"),
    [
        (82, 1, r"scale_m 1 makes a body 82 m long; if its unit is the millimetre, give scale_m: 0\.001\.$"),
        (0.08, 1e-3, r"makes a body 0\.08 mm long; if its unit is the metre, give scale_m: 1\.$"),
        (1, 0, r"scale_m is 0; give the length"),
        (1, 100, r"makes a body 100 m long; check scale_m\.$"),
    ],
)
def test_an_impossible_scale_is_refused_with_the_likely_one(size, given, message):
    with pytest.raises(InputError, match=message):
        choose_scale("a", box(size), given)


def test_a_body_of_one_metre_is_accepted_and_one_of_two_said():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert choose_scale("a", box(1), 1.0) == 1.0
    with pytest.warns(UserWarning, match="makes a body 2 m long, which no organ is"):
        choose_scale("a", box(1), 2.0)


@pytest.mark.parametrize(("length", "words"), [(82, "82 m"), (0.2, "20 cm"), (0.082, "82 mm"), (8e-5, "0.08 mm")])
def test_lengths_in_words(length, words):
    assert in_words(length) == words
