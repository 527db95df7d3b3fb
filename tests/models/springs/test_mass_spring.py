"""Spring networks at rest: the adjoint's slopes, what a fit finds again, and answers that were checked."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark.accuracy import errors
from palpate.benchmark.database import Database
from palpate.benchmark.load import Load
from palpate.errors import InputError, NotConverged
from palpate.models.kinds import Springs
from palpate.models.model_registry import MODELS
from palpate.models.springs.mass_spring import Network, _Search, fit_moduli

KINDS = ("springs", "springs_volume", "springs_nodal", "springs_nodal_volume")


@pytest.fixture(scope="module")
def network(slab_case) -> Network:
    return Network(slab_case[0], 0)


@pytest.fixture(scope="module")
def own_samples(slab_case, network) -> tuple[Database, np.ndarray]:
    """Samples that a known network answers, half as hard as those of finite elements; its moduli."""
    case = slab_case[0]
    young = 2000.0 * np.exp(0.5 * np.sin(30.0 * network.rest[:, 0]))
    network.stiffen(young, 3.0)
    fine, force = [], 0.5 * case.database.force
    for contact, newtons in zip(case.database.contact, force, strict=True):
        network.press(int(contact), newtons)
        fine.append(network.up @ (network.settle(network.rest) - network.rest))
    return replace(case.database, fine=np.array(fine), force=force), young


def test_slopes_are_those_of_the_misfit(slab_case, network):
    """Against central differences, along a random direction of all moduli and along κ."""
    search = _Search(network, slab_case[0].database, volume=True)
    count = len(network.rest)
    start = np.append(0.1 * np.random.default_rng(0).normal(size=count), 0.05)
    slopes = search._evaluate(start, count)[1]
    for direction in (np.append(np.random.default_rng(1).normal(size=count), 0.0), np.eye(count + 1)[-1]):
        step = 1e-3 / np.linalg.norm(direction) * direction
        ahead, behind = (search._evaluate(start + sign * step, count)[0] for sign in (1.0, -1.0))
        assert slopes @ step == pytest.approx(0.5 * (ahead - behind), rel=0.02)


def test_a_fit_finds_what_made_the_samples(network, own_samples):
    samples, young = own_samples
    one = fit_moduli(network, samples, False, True, (8, 40))
    each = fit_moduli(network, samples, True, True, (8, 40))
    assert one.misfit < 0.06 and each.misfit < 0.5 * one.misfit
    assert 0.8 * young.mean() < one.young_pa[0] < 1.2 * young.mean()
    assert np.corrcoef(np.log(each.young_pa), np.log(young))[0, 1] > 0.5


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name.startswith("springs_nodal") else name for name in KINDS]
)
def test_fitted_springs_answer_contacts_they_never_saw(slab_case, grid, name):
    """In most samples better than its coarse elements, which are wrong by 19 % on this crude mesh: they are not fitted.

    Under single samples springs turn inside out at the contact; there they are far off, as they should be seen to be.
    """
    case, test, _ = slab_case
    tried = MODELS[name].tried(case, grid)
    assert len(tried) >= 5
    solver = tried[-1].prepare(case)
    asked = zip(test.contact, test.force, test.fine, strict=True)
    assert np.median([errors(solver.respond(Load.at(c, f)), u).rmse_of_peak for c, f, u in asked]) < 0.18
    assert 0.0 < solver.memory_mb < 10.0


def test_small_loads_need_one_iteration(slab_case, network):
    case = slab_case[0]
    network.stiffen(np.full(len(network.rest), 3000.0), 1.0)
    network.press(int(case.database.contact[0]), 1e-5 * case.database.force[0])
    one, all_of_them = network.approach(1) - network.rest, network.settle(network.rest) - network.rest
    assert np.linalg.norm(one - all_of_them) < 1e-3 * np.linalg.norm(all_of_them)


def test_nothing_is_answered_unchecked(slab_case):
    case = slab_case[0]
    solver = Springs(iterations=1).prepare(case)
    load = Load.at(int(case.database.contact[0]), np.zeros(3))
    assert not solver.respond(load).any()
    load.presses[0].force[0] = np.nan  # loads are checked when they are made
    with pytest.raises(NotConverged, match="find no way"):
        solver.respond(load)
    with pytest.raises(InputError, match="not a free surface node"):
        solver.respond(Load.at(case.body.anchors[0][0], np.ones(3)))
