"""The corotated two-level correction: exact where it must be, on a body that is really simulated."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from scipy.linalg import polar

from palpate.benchmark.presses import LOAD_COLUMNS
from palpate.benchmark.settings import FitOptions, Widths
from palpate.benchmark.static_responses import assemble, press
from palpate.bodies.mesh import TetMesh
from palpate.models.enrichment.detail_correction import DetailCorrection, NodalRotations, Scale, fit_scale
from palpate.models.enrichment.training_samples import Training, gather
from palpate.models.interpolation import Interpolation

PROTOCOLS = ("paper", "live")
FORCE = np.array([0.1, 0.2, -0.4])
OPTIONS = FitOptions(
    neighbours=10, sigma_relative=Widths(min=0.01, max=100, count=3), folds=4, split="contacts", seed=0
)


def simulate(body, contacts, forces):
    """A database of these presses."""
    rows = [[i, c, *f, 0.0] for i, (c, f) in enumerate(zip(contacts, forces, strict=True))]
    loads = pd.DataFrame(rows, columns=LOAD_COLUMNS)
    fine = press(body, len(body.levels) - 1, loads, 1e-8)
    return assemble(body, loads, fine, press(body, 0, loads, 1e-8), "abc")


@pytest.fixture(scope="module")
def tiny(slab):
    """One press, ten times weaker from sample to sample."""
    return simulate(slab, [44] * 3, [f * FORCE for f in (1e-1, 1e-2, 1e-3)])


@pytest.fixture(scope="module")
def db(slab, slab_compliance):
    """Presses along the inward normal that move the body by about 6 and 12 % of its size."""
    moved = np.linalg.norm(slab.coarse.nodes[slab_compliance.contacts, 0, None], axis=1)
    contacts = np.repeat(slab_compliance.contacts[moved > 0.09], 2)
    forces = []
    for i, contact in enumerate(contacts):
        normal = slab.coarse.normals[contact]
        own = np.tensordot(normal, slab_compliance.fine[slab_compliance.row(contact)], 1)
        forces.append(-(0.012, 0.024)[i % 2] * normal / np.linalg.norm(own, axis=1).max())
    return simulate(slab, contacts, forces)


def error(method, db, protocol, i):
    found = method.predict(db.coarse(protocol)[i], int(db.contact[i]), db.force[i])
    return np.sqrt(np.mean(np.sum((found - db.fine[i]) ** 2, axis=1))) / db.peaks[i]


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_tiny_loads_are_exact_to_first_order(slab_compliance, tiny, protocol):
    method = DetailCorrection(tiny, slab_compliance, protocol)
    _, larger, least = (error(method, tiny, protocol, i) for i in range(3))
    assert least < 1e-4
    assert larger / least == pytest.approx(10, rel=0.15)
    assert error(Interpolation(tiny), tiny, protocol, 2) > 100 * least


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_a_linear_world_is_exact(slab, slab_compliance, tiny, protocol):
    """Coarse and fine linear responses of any size, as long as no rotation is seen in them."""
    method = DetailCorrection(tiny, slab_compliance, protocol)
    seen = {"paper": slab_compliance.restricted, "live": slab_compliance.coarse}[protocol]
    row = slab_compliance.row(44)
    for factor in (1e-9, 1e-7):
        coarse, fine = (np.tensordot(factor * FORCE, u[row], 1) for u in (seen, slab_compliance.fine))
        found = method.predict(coarse, 44, factor * FORCE)
        assert np.abs(found - fine).max() < 1e3 * factor * np.abs(fine).max()
        assert method._query(coarse, 44, factor * FORCE).ratios == pytest.approx(1.0, abs=1e3 * factor)


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_turns_with_body_and_force(slab, slab_compliance, db, rotation, protocol):
    """Turning and moving a deformed body and its force turns and moves the answer."""
    method, coarse, fine = DetailCorrection(db, slab_compliance, protocol), db.coarse_nodes, db.nodes_fine_surface
    for i in (0, 5):
        contact, force, u = int(db.contact[i]), db.force[i], db.coarse(protocol)[i]
        here = fine + method.predict(u, contact, force)
        for angle in (0.3, 2.0, np.pi):
            turn, shift = rotation(angle), np.array([0.3, -0.1, 0.2])
            turned = (coarse + u) @ turn.T + shift - coarse
            there = fine + method.predict(turned, contact, turn @ force)
            assert np.abs(there - here @ turn.T - shift).max() < 1e-11


def test_kept_nodes_stay_where_the_subsample_has_them(slab, slab_compliance, db):
    """With the paper's protocol the coarse nodes' displacements are given: the detail must vanish there."""
    method = DetailCorrection(db, slab_compliance, "paper")
    kept = np.searchsorted(slab.fine.surface, slab.coarse.surface)
    found = method.predict(db.coarse_paper[3], int(db.contact[3]), db.force[3])
    assert np.abs(found[kept] - db.coarse_paper[3][slab.coarse.surface]).max() < 1e-14
    assert np.abs(found[kept] - db.fine[3][kept]).max() < 1e-14


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_a_scale_is_learnt_that_helps_on_other_contacts(slab_compliance, db, protocol):
    contacts = np.unique(db.contact)
    train = np.flatnonzero(np.isin(db.contact, contacts[::2]))
    test = np.setdiff1d(np.arange(len(db.contact)), train)
    plain, learnt = (DetailCorrection(db, slab_compliance, protocol) for _ in range(2))
    assert not plain.scale.beta.any()
    learnt.learn(gather(db.take(train), protocol, OPTIONS))
    rivals = [np.mean([error(m, db, protocol, i) for i in test]) for m in (learnt, plain, Interpolation(db))]
    assert rivals[0] <= rivals[1] < 0.5 * rivals[2]


def test_the_rest_is_learnt_in_the_turned_frame(slab_compliance, db):
    """Something systematic that neither interpolation nor detail knows, fixed to the turning body, is found again."""
    mesh, k = TetMesh(db.coarse_nodes, db.coarse_tetrahedra), len(db.contact)
    mode = np.random.default_rng(0).normal(size=db.fine.shape[1:])
    plain, learnt = (DetailCorrection(db, slab_compliance, "live") for _ in range(2))
    fine = []
    for coarse, contact, force in zip(db.coarse_live, db.contact.tolist(), db.force, strict=True):
        turned = (db.prolongation @ NodalRotations(mesh).at(3 * coarse).reshape(-1, 9)).reshape(-1, 3, 3)
        new = 0.01 * np.linalg.norm(coarse) * np.einsum("nij,nj->ni", turned, mode)
        fine.append(plain.predict(3 * coarse, contact, force) + new)
    world = replace(db, fine=np.array(fine), coarse_live=3 * db.coarse_live)
    test = np.arange(0, k, 5)
    train = np.setdiff1d(np.arange(k), test)
    settings = OPTIONS.but(split="samples", sigma_relative=Widths(min=0.1, max=100, count=7))
    learnt.learn(gather(world.take(train), "live", settings))
    assert np.isnan(plain.sigma_m) and learnt.sigma_m > 0
    errors = [np.mean([error(m, world, "live", i) for i in test]) for m in (learnt, plain)]
    assert errors[0] < 0.1 * errors[1]


def test_without_turning_the_force_acts_on_the_rest_shape(slab, slab_compliance, db, tiny, rotation):
    flat, method = (DetailCorrection(db, slab_compliance, "live", turned=t) for t in (False, True))
    contact, force, coarse = int(tiny.contact[2]), tiny.force[2], tiny.coarse_live[2]
    small = [m.predict(coarse, contact, force) for m in (flat, method)]
    assert np.abs(small[0] - small[1]).max() < 1e-3 * np.abs(small[1]).max()
    large = [np.mean([error(m, db, "live", i) for i in range(len(db.contact))]) for m in (flat, method)]
    assert large[0] > 1.1 * large[1]


BETA = np.array([0.4, -0.7])


@pytest.fixture
def scaled_world():
    """40 samples of 10 contacts whose detail is applied 1 + β · (ratios − 1) times; folds hold out contacts."""
    random = np.random.default_rng(0)
    contact = np.repeat(np.arange(10), 4)
    detail = 1e-3 * random.normal(size=(40, 30, 3))
    ratios = 1.0 + 0.2 * random.normal(size=(40, 2))
    peaks = random.uniform(0.01, 0.03, 40)
    training = Training(SimpleNamespace(contact=contact, peaks=peaks), "live", OPTIONS, contact % 5)
    return random, ratios, detail, training


def scaled(beta, ratios, detail):
    return (1.0 + (ratios - 1.0) @ beta)[:, None, None] * detail


def test_finds_a_known_scale_also_under_noise(scaled_world):
    random, ratios, detail, training = scaled_world
    missing = scaled(BETA, ratios, detail)
    assert fit_scale(ratios, detail, missing, training).beta == pytest.approx(BETA, rel=1e-5)
    missing += 3e-4 * random.normal(size=detail.shape)
    assert fit_scale(ratios, detail, missing, training).beta == pytest.approx(BETA, abs=0.05)


def test_learns_nothing_from_nothing(scaled_world):
    random, ratios, detail, training = scaled_world
    assert not fit_scale(ratios, detail, detail, training).beta.any()  # the detail is right as it is
    assert not fit_scale(np.ones_like(ratios), detail, 2 * detail, training).beta.any()  # ratios say nothing
    assert not fit_scale(ratios, np.zeros_like(detail), detail, training).beta.any()  # there is no detail
    noisy = detail + 1e-3 * random.normal(size=detail.shape)
    assert np.abs(fit_scale(ratios, detail, noisy, training).beta).max() < 0.2


def test_does_not_believe_what_other_contacts_contradict(scaled_world):
    """Each fold wants the opposite of the rest: no scale generalises, so none is applied."""
    _, ratios, detail, training = scaled_world
    sign = np.where(training.db.contact % 2, 1.0, -1.0)
    missing = (1.0 + sign * ((ratios - 1.0) @ BETA))[:, None, None] * detail
    alternating = replace(training, fold=training.db.contact % 2)
    assert not fit_scale(ratios, detail, missing, alternating).beta.any()


def test_bounds_are_those_of_the_samples_only_where_that_helps_at_other_contacts(scaled_world):
    """A scale that saturates at a contact of large ratios is bounded; one that goes on growing is not."""
    _, ratios, detail, training = scaled_world
    ratios = ratios.copy()
    ratios[training.db.contact % 5 == 0, 0] += 2.0  # a fold beyond all others
    beta = np.array([0.5, 0.0])
    growing = fit_scale(ratios, detail, scaled(beta, ratios, detail), training)
    assert growing.beta == pytest.approx(beta, abs=1e-3) and np.isinf([growing.low, growing.high]).all()
    within = np.minimum(ratios, 1.3)
    saturated = fit_scale(ratios, detail, scaled(beta, within, detail), training)
    assert np.isfinite([saturated.low, saturated.high]).all()
    assert saturated.of(np.array([9.0, 1.0])) == saturated.high < Scale(saturated.beta).of(np.array([9.0, 1.0]))


@pytest.mark.parametrize("angle", [0.0, 1.0, np.pi])
def test_an_affine_deformation_turns_every_node_by_its_polar_part(slab, rotation, angle):
    nodes, f = slab.coarse.nodes, rotation(angle) @ [[1.3, 0.2, 0.0], [0.1, 0.8, -0.1], [0.0, 0.1, 1.1]]
    found = NodalRotations(slab.coarse).at(nodes @ f.T + [0.1, 0.2, -0.3] - nodes)
    assert np.abs(found - polar(f)[0]).max() < 1e-12


def test_the_mean_around_a_node_is_weighted_by_volume(slab):
    """Moving one node turns its neighbours by the polar part of what their elements say together."""
    mesh, moved = slab.coarse, np.zeros_like(slab.coarse.nodes)
    moved[44] = [0.02, -0.03, 0.05]
    corners = mesh.nodes[mesh.tetrahedra]
    rest, now = ((c[:, 1:] - c[:, :1]).swapaxes(1, 2) for c in (corners, corners + moved[mesh.tetrahedra]))
    f = now @ np.linalg.inv(rest)
    found = NodalRotations(mesh).at(moved)
    for node in (44, 41, 0, 30):
        around = (mesh.tetrahedra == node).any(axis=1)
        mean = np.average(f[around], axis=0, weights=mesh.volumes[around])
        assert np.abs(found[node] - polar(mean)[0]).max() < 1e-11
