"""Goals: what they keep, what they follow, and that nothing puts them off."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.particles import particles_of
from palpate.effects import shape_matching
from palpate.effects.shape_matching import make_clusters
from palpate.errors import InputError

CLUSTERS = {
    "one": {"kind": "one"},
    "tetrahedra": {"kind": "tetrahedra"},
    "cubes": {"kind": "cubes", "edge_m": 0.09, "overlap": 0.5},
}
NONE = np.empty((0, 3), dtype=np.int64)
MODES = ["rigid", "linear", "quadratic"]


@pytest.fixture(scope="module")
def particles(slab):
    return particles_of(slab, 0, surface=False)


def matched(particles, mode, kind="one", beta=0.5, alpha=0.5):
    settings = {"mode": mode, "alpha": alpha, "beta": beta, "clusters": CLUSTERS[kind]}
    return shape_matching.make(particles, settings)


def goals(effect, x):
    out = np.full_like(x, np.nan)
    effect.goals(x, out)
    return out


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", CLUSTERS)
def test_a_moved_and_turned_body_is_where_it_wants_to_be(particles, rotation, mode, kind):
    effect = matched(particles, mode, kind)
    for angle in (0.0, 1.0, np.pi):
        x = particles.nodes @ rotation(angle).T + [1e3, -2e3, 5.0]
        assert np.abs(goals(effect, x) - x).max() < 1e-11


@pytest.mark.parametrize("add", [False, True])
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", CLUSTERS)
def test_goals_keep_momentum_and_angular_momentum(particles, mode, kind, add):
    """However a particle's clusters differ in number and mass."""
    random = np.random.default_rng(0)
    uneven = replace(particles, masses=particles.masses * random.uniform(0.1, 3, len(particles.masses)))
    x = particles.nodes + 0.3 * particles.size * random.normal(size=particles.nodes.shape)
    clusters = make_clusters(uneven, CLUSTERS[kind])
    pull = uneven.masses[:, None] * (goals(shape_matching.ShapeMatching(uneven, clusters, mode, 0.1, 0.5, add), x) - x)
    assert np.linalg.norm(pull.sum(axis=0)) < 1e-12 * np.abs(pull).sum()
    assert np.linalg.norm(np.cross(x, pull).sum(axis=0)) < 1e-12 * np.abs(pull).sum() * particles.size


@pytest.mark.parametrize("mode", MODES)
def test_added_goals_are_the_pulls_of_each_cluster_alone(particles, mode):
    """α (g − x) of the whole is the sum of those of effects that have one cluster each."""
    random = np.random.default_rng(3)
    x = particles.nodes + 0.1 * particles.size * random.normal(size=particles.nodes.shape)
    clusters = make_clusters(particles, CLUSTERS["cubes"])
    whole = shape_matching.ShapeMatching(particles, clusters, mode, 0.05, 0.5, add=True)
    parts = np.zeros_like(x)
    for first, last in zip(clusters.starts[:-1], clusters.starts[1:], strict=True):
        members = clusters.members[first:last]
        one = replace(
            particles, nodes=particles.nodes[members], masses=particles.masses[members], triangles=NONE, tetrahedra=NONE
        )
        parts[members] += 0.05 * (goals(matched(one, mode, beta=0.5), x[members]) - x[members])
    assert clusters.shared_by.max() > 1
    assert np.abs(whole.alpha * (goals(whole, x) - x) - parts).max() < 1e-12 * particles.size


def test_added_goals_that_may_be_unstable_are_refused(particles):
    settings = {"mode": "linear", "alpha": 0.5, "beta": 0.5, "goals": "sum", "clusters": {"kind": "each_tetrahedron"}}
    most = make_clusters(particles, settings["clusters"]).shared_by.max()
    with pytest.raises(InputError, match=f"below {4 / most:.3g} only; lower alpha"):
        shape_matching.make(particles, settings)
    assert shape_matching.make(particles, settings | {"alpha": 3.9 / most}).alpha == pytest.approx(3.9)


def test_the_rigid_goal_is_the_best_fit(particles, rotation):
    random = np.random.default_rng(1)
    x = particles.nodes + 0.05 * particles.size * random.normal(size=particles.nodes.shape)
    best = goals(matched(particles, "rigid"), x)
    misfit = particles.masses @ ((x - best) ** 2).sum(axis=1)
    centre = np.average(best, axis=0, weights=particles.masses)
    for angle in (1e-4, -1e-4, 0.1):
        turned = (best - centre) @ rotation(angle).T + centre
        assert particles.masses @ ((x - turned) ** 2).sum(axis=1) > misfit


def test_modes_follow_what_their_terms_can_say(particles):
    """With β = 1 a bend is a goal of the quadratic mode, a shear without change of volume of the linear one."""
    shear = particles.nodes + 0.3 * particles.nodes[:, [1, 2, 0]] * [1, 0, 0]
    bend = particles.nodes + 2.0 * particles.nodes[:, [0]] ** 2 * [0, 0, 1]
    for mode, x, follows in (
        ("rigid", shear, False),
        ("linear", shear, True),
        ("quadratic", shear, True),
        ("linear", bend, False),
        ("quadratic", bend, True),
    ):
        left = np.abs(goals(matched(particles, mode, beta=1.0), x) - x).max() / np.abs(x - particles.nodes).max()
        assert (left < 1e-12) == follows
        assert follows or left > 0.1


def test_the_linear_mode_restores_volume(particles):
    effect = matched(particles, "linear", beta=1.0)
    for stretch in ([1.2, 1.0, 1.0], [0.7, 0.9, 1.1], [1.25, 1.25, 1.25]):
        goal = goals(effect, particles.nodes * stretch)
        sides = np.linalg.lstsq(particles.nodes - particles.nodes.mean(axis=0), goal - goal.mean(axis=0))[0]
        assert np.linalg.det(sides) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", CLUSTERS)
def test_no_position_puts_goals_off(particles, mode, kind):
    effect = matched(particles, mode, kind)
    size = particles.size
    for factor in (
        [0, 0, 0],
        [1, 0, 0],
        [1, 1, 0],
        [-1, 1, 1],
        [-1, -1, -1],
        [1e-12, 1, 1],
        [1e-200, 0, 0],
        [50, 50, 50],
    ):
        x = particles.nodes * np.array(factor, dtype=float)
        found = goals(effect, x)
        assert np.isfinite(found).all()
        assert np.ptp(found, axis=0).max() < 2.5 * max(size, np.ptp(x, axis=0).max())
    heap = np.random.default_rng(0).uniform(-10 * size, 10 * size, particles.nodes.shape)
    assert np.ptp(goals(effect, heap), axis=0).max() < 25 * size


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("flat", [[1, 1, 0], [0, 1, 0], [0, 0, 0]])
def test_bodies_that_are_flat_straight_or_a_dot_at_rest(particles, rotation, mode, flat):
    thin = replace(particles, nodes=particles.nodes * np.array(flat, dtype=float) @ rotation(0.7).T)
    effect = matched(thin, mode)
    x = thin.nodes @ rotation(2.0).T + 1.0
    assert np.abs(goals(effect, x) - x).max() < 1e-13
    assert np.isfinite(goals(effect, particles.nodes)).all()
    assert (effect.ranks == sum(flat)).all()


def test_the_answer_does_not_depend_on_the_one_before(particles):
    random = np.random.default_rng(2)
    used, x = matched(particles, "quadratic", "cubes"), particles.nodes
    for _ in range(50):
        x = x + 0.02 * random.normal(size=x.shape)
        assert np.abs(goals(used, x) - goals(matched(particles, "quadratic", "cubes"), x)).max() < 1e-12


@pytest.mark.parametrize(
    "change", [{"mode": "cubic"}, {"goals": "most"}, {"alpha": 1.5}, {"alpha": np.nan}, {"beta": -0.1}]
)
def test_settings_out_of_range_are_refused(particles, change):
    settings = {"mode": "rigid", "alpha": 0.5, "beta": 0.5, "clusters": CLUSTERS["one"]} | change
    with pytest.raises(InputError, match=next(iter(change))):
        shape_matching.make(particles, settings)
