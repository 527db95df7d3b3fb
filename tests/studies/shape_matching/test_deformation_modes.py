"""Modes follow what a polynomial of their order fits exactly, and miss what the best fit misses."""

import numpy as np
import pytest

from palpate.studies.shape_matching import clusters


@pytest.fixture(scope="module")
def table():
    return clusters.deformation_modes()


def best(rest, x, quadratic):
    """The part of the displacement that the least-squares polynomial leaves, by another way than goals are found."""
    q = rest - rest.mean(axis=0)
    a, b, c = q.T
    terms = [np.ones_like(a), a, b, c] + ([a * a, b * b, c * c, a * b, b * c, c * a] if quadratic else [])
    columns = np.stack(terms, axis=1)
    fitted = columns @ np.linalg.lstsq(columns, x, rcond=None)[0]
    return np.linalg.norm(fitted - x) / np.linalg.norm(x - rest)


def test_each_mode_misses_what_the_best_polynomial_misses(table):
    for (deformation, mode), group in table.groupby(["deformation", "mode"]):
        rest, x, goal = (group[[f"{w}{a}_m" for a in "xyz"]].to_numpy() for w in ("rest_", "", "goal_"))
        left = np.linalg.norm(goal - x) / np.linalg.norm(x - rest)
        assert left == pytest.approx(group["left"].iloc[0], rel=1e-12)
        if mode == "quadratic" or (mode, deformation) == ("linear", "linear"):
            assert left < 1e-12 and best(rest, x, mode == "quadratic") < 1e-12
        elif mode == "linear":  # it keeps the volume too, which costs little
            assert best(rest, x, False) - 1e-12 <= left < 1.25 * best(rest, x, False)
            assert left > 0.2
        else:
            assert left > best(rest, x, False) - 1e-12 and left > 0.2


def test_the_deformations_are_of_the_orders_that_they_are_named_after(table):
    """A bend and a twist have no linear part in the middle, and the combined one is their sum."""
    one = table[table["mode"] == "rigid"].set_index(["deformation", "particle"])
    moved = {
        name: (group[["x_m", "y_m", "z_m"]].to_numpy() - group.filter(like="rest_").to_numpy())
        for name, group in one.groupby(level=0)
    }
    assert np.abs(moved["combined"] - moved["linear"] - moved["bent"] - moved["twisted"]).max() < 1e-15
    q = one.loc["bent"].filter(like="rest_").to_numpy()
    q = q - q.mean(axis=0)
    for name in ("bent", "twisted"):
        assert np.abs(q.T @ moved[name]).max() < 1e-15
