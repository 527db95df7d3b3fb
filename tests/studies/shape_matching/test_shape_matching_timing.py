"""What is timed, and how the table is read."""

import numpy as np
import pytest

from palpate.studies.shape_matching import shape_matching_timing


@pytest.fixture(scope="module")
def table():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shape_matching_timing, "OBJECTS", (1, 30, 100))
        few = {n: cells for n, cells in shape_matching_timing.DIVISIONS.items() if n < 10_000}
        patch.setattr(shape_matching_timing, "DIVISIONS", few)
        patch.setattr(shape_matching_timing, "processor_seconds", lambda step, least_s: step() or 1e-3)
        return shape_matching_timing.measure(1)


def test_every_row_is_what_it_says(table):
    assert list(table)[:4] == ["particles", "clusters", "mode", "objects"]
    assert {"ms_per_step", "threads", "memberships"} <= set(table)
    assert set(table["clusters"]) == {1, 8, 18} and set(table["mode"]) == {"rigid", "linear", "quadratic"}
    assert (table["all_particles"] == table["particles"] * table["objects"]).all()
    assert (table["memberships"] >= table["all_particles"]).all()
    assert (table["ms_per_step"] == 1.0).all()
    assert shape_matching_timing.headline(table) == 1.0


def test_exponents_are_fitted_to_many_particles(table):
    power = table.assign(ms_per_step=np.where(table["all_particles"] < 3000, 7.0, 1e-4 * table["all_particles"] ** 1.2))
    fits = shape_matching_timing.exponents(power)
    assert len(fits) == 9 and np.allclose(fits["exponent"], 1.2)
