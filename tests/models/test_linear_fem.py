"""The linear rival is the compliance times the force."""

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.presses import LOAD_COLUMNS
from palpate.benchmark.static_responses import press
from palpate.errors import InputError
from palpate.models.linear_fem import LinearFem


def test_is_the_compliance_times_the_force(slab_compliance):
    method, row = LinearFem(slab_compliance), 11
    contact, force = int(slab_compliance.contacts[row]), np.array([0.3, -0.2, 0.5])
    x, y, z = slab_compliance.fine[row]
    expected = 0.3 * x - 0.2 * y + 0.5 * z
    for coarse in (slab_compliance.coarse[row, 0], np.full_like(slab_compliance.coarse[row, 0], np.nan)):
        assert np.abs(method.predict(coarse, contact, force) - expected).max() < 1e-15
    with pytest.raises(InputError, match="contact 0 is not a free"):
        method.predict(coarse, 0, force)


def test_is_the_fine_response_to_a_small_force(slab, slab_compliance):
    """Off by first order in the force: a tenth of it, a tenth of the relative error."""
    method, force = LinearFem(slab_compliance), np.array([0.1, 0.2, -0.4])
    errors = []
    for factor in (1e-2, 1e-3):
        loads = pd.DataFrame([[0, 44, *(factor * force), 0.0]], columns=LOAD_COLUMNS)
        fine = press(slab, 1, loads, 1e-8).displacement[0, slab.fine.surface]
        errors.append(np.abs(method.predict(None, 44, factor * force) - fine).max() / np.abs(fine).max())
    assert errors[0] < 1e-2 and errors[0] / errors[1] == pytest.approx(10, rel=0.1)
