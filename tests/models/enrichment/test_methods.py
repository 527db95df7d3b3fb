"""Every method: finite, blind to node numbers, fitted on training samples only, exact where it must be."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array

from palpate.models.enrichment.methods import build
from palpate.models.enrichment.paper_enrichment import Blend, DescribedSamples
from palpate.models.enrichment.pod_rbf import PodRbf
from palpate.models.enrichment.ridge import KernelRidgeDetail, RidgeUpsampling
from palpate.models.enrichment.training_samples import gather
from palpate.models.interpolation import Interpolation
from palpate.solvers.compliance import Compliance

TRAIN, TEST = np.arange(0, 18), np.arange(18, 24)


@pytest.fixture(scope="module")
def compliance(db):
    """No physics: these tests are about what is learnt."""
    random = np.random.default_rng(0)
    m, n, coarse = len(db.coarse_surface), len(db.nodes_fine_surface), len(db.coarse_nodes)
    sizes = ((m, 3, n, 3), (m, 3, coarse, 3), (m, 3, coarse, 3))
    return Compliance(db.coarse_surface, *(1e-3 * random.normal(size=size) for size in sizes))


@pytest.fixture(scope="module")
def methods(db, compliance, settings):
    return build(gather(db.take(TRAIN), "paper", settings, compliance))


def predict(method, db, i, protocol="paper"):
    return method.predict(db.coarse(protocol)[i], int(db.contact[i]), db.force[i])


def of_peak(predicted, db, i):
    return np.sqrt(np.mean(np.sum((predicted - db.fine[i]) ** 2, axis=1))) / db.peaks[i]


def described(db, features, settings, train=TRAIN):
    return DescribedSamples(gather(db.take(train), "paper", settings), features)


def rivals(training):
    return RidgeUpsampling(training), KernelRidgeDetail(training), PodRbf(training)


def test_nothing_is_learnt_from_test_samples(db, compliance, settings, methods):
    other = {name: getattr(db, name).copy() for name in ("fine", "coarse_paper", "coarse_live")}
    for array in other.values():
        array[TEST] = 7.0
    for name, method in build(gather(replace(db, **other).take(TRAIN), "paper", settings, compliance)).items():
        assert np.array_equal(method.sigma_m, methods[name].sigma_m, equal_nan=True), name
        assert np.array_equal(predict(method, db, 20), predict(methods[name], db, 20)), name


def renumbered(db, seed):
    """The same body and samples with coarse and fine surface nodes in another order."""
    random = np.random.default_rng(seed)
    coarse, fine = random.permutation(len(db.coarse_nodes)), random.permutation(len(db.nodes_fine_surface))
    new_coarse, new_fine = np.argsort(coarse), np.argsort(fine)
    surface = np.sort(new_coarse[db.coarse_surface])
    rows = np.searchsorted(db.coarse_surface, coarse[surface])
    return replace(
        db,
        nodes_fine_surface=db.nodes_fine_surface[fine],
        triangles=new_fine[db.triangles],
        coarse_nodes=db.coarse_nodes[coarse],
        coarse_tetrahedra=new_coarse[db.coarse_tetrahedra],
        coarse_surface=surface,
        prolongation=csr_array(db.prolongation[fine][:, coarse]),
        contact_normals=db.contact_normals[rows],
        contact=new_coarse[db.contact],
        fine=db.fine[:, fine],
        coarse_paper=db.coarse_paper[:, coarse],
        coarse_live=db.coarse_live[:, coarse],
    ), fine


@pytest.mark.parametrize("name", ["unordered", "framed"])
def test_blends_do_not_depend_on_numbering(db, settings, name):
    """Framed ties go by position, so this holds on a symmetric mesh too; plain ordering does not."""
    other, fine = renumbered(db, 5)
    for kind in ("signed", "nonnegative_a", "clipped"):
        here, there = (Blend(described(d, name, settings), kind, 2e-3) for d in (db, other))
        for i in TEST:
            assert predict(there, other, i) == pytest.approx(predict(here, db, i)[fine], abs=1e-9 * db.peaks[i])


def test_ordered_does_not_depend_on_numbering_without_ties(db, settings):
    crooked = 1e-4 * np.random.default_rng(2).normal(size=db.nodes_fine_surface.shape)
    moved = {"nodes_fine_surface": db.nodes_fine_surface + crooked, "coarse_nodes": db.coarse_nodes.copy()}
    moved["coarse_nodes"][db.coarse_surface] += 1e-4 * np.random.default_rng(3).normal(size=(len(db.coarse_surface), 3))
    irregular = replace(db, **moved)
    other, fine = renumbered(irregular, 5)
    here, there = (Blend(described(d, "ordered", settings), "signed", 2e-3) for d in (irregular, other))
    for i in TEST:
        assert predict(there, other, i) == pytest.approx(predict(here, irregular, i)[fine], abs=1e-9)


@pytest.mark.parametrize("protocol", ["paper", "live"])
def test_a_linear_world_is_learnt_by_the_linear_rivals(db, settings, protocol):
    """Fine = a fixed linear map of the coarse samples: ridge and kernel ridge must find it."""
    random = np.random.default_rng(0)
    modes = random.normal(size=(4, *db.coarse_paper.shape[1:]))
    detail = random.normal(size=(4, *db.fine.shape[1:]))
    amounts = 1e-3 * random.normal(size=(24, 4))
    coarse = np.tensordot(amounts, modes, 1)
    fine = np.array([db.prolongation @ c for c in coarse]) + 0.1 * np.tensordot(amounts, detail, 1)
    world = replace(db, coarse_paper=coarse, coarse_live=coarse, fine=fine)
    for method in rivals(gather(world.take(TRAIN), protocol, settings))[:2]:
        for i in TEST:
            assert of_peak(predict(method, world, i, protocol), world, i) < 1e-3
    assert of_peak(predict(Interpolation(world), world, 20), world, 20) > 1e-2


def test_rivals_learn_from_seen_contacts(db, settings):
    seen = np.arange(1, 24, 4)
    train = np.setdiff1d(np.arange(24), seen)
    methods = *rivals(gather(db.take(train), "paper", settings)), Interpolation(db)
    ridge, kernel, pod, plain = (np.mean([of_peak(predict(m, db, i), db, i) for i in seen]) for m in methods)
    assert ridge < plain and kernel < plain
    assert pod < np.mean([of_peak(db.fine[train].mean(axis=0), db, i) for i in seen])
