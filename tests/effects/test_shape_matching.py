"""Goals: what they keep, what they follow, and that nothing puts them off."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import merge_particles, particles_of
from palpate.bodies.simple_shapes import box
from palpate.effects import shape_matching
from palpate.effects.settings import Clusters, ShapeMatching
from palpate.effects.shape_matching import make_clusters
from palpate.errors import InputError

CLUSTERS = {kind: Clusters(kind=kind) for kind in ("one", "tetrahedra", "each_tetrahedron")}
CLUSTERS["cubes"] = Clusters(kind="cubes", edge_m=0.09)
NONE = np.empty((0, 3), dtype=np.int64)
KINDS = ["one", "tetrahedra", "cubes"]
MODES = ["rigid", "linear", "quadratic"]


@pytest.fixture(scope="module")
def particles(slab):
    return particles_of(slab, 0, surface=False)


def matched(particles, mode, kind="one", beta=0.5, alpha=0.5):
    return shape_matching.make(particles, ShapeMatching(mode=mode, alpha=alpha, beta=beta, clusters=CLUSTERS[kind]))


def goals(effect, x):
    out = np.full_like(x, np.nan)
    effect.goals(x, out)
    return out


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", KINDS)
def test_a_moved_and_turned_body_is_where_it_wants_to_be(particles, rotation, mode, kind):
    effect = matched(particles, mode, kind)
    for angle in (0.0, 1.0, np.pi):
        x = particles.nodes @ rotation(angle).T + [1e3, -2e3, 5.0]
        assert np.abs(goals(effect, x) - x).max() < 1e-11


@pytest.mark.parametrize("add", [False, True])
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", KINDS)
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


def test_clusters_of_a_symmetric_mesh_are_symmetric_in_any_order_of_its_elements():
    mesh = box([0.1, 0.06, 0.12], [4, 2, 6])
    block = particles_of(nest("block", mesh, 0, np.arange(0), Material(3000.0, 0.3, 1000.0)), 0, surface=False)
    tree, found = cKDTree(mesh.nodes), around_tetrahedra(block)
    shuffled = np.random.default_rng(0).permutation(mesh.tetrahedra)
    assert around_tetrahedra(replace(block, tetrahedra=shuffled)) == found and len(found) < len(shuffled) / 2
    for axis in range(3):
        mirrored = mesh.nodes.copy()
        mirrored[:, axis] = np.ptp(mesh.nodes[:, axis]) - mirrored[:, axis]
        image = tree.query(mirrored)[1]
        assert {frozenset(image[list(group)].tolist()) for group in found} == found


def around_tetrahedra(particles) -> set[frozenset[int]]:
    """The clusters around tetrahedra, as sets of nodes."""
    return {frozenset(group.tolist()) for group in groups(make_clusters(particles, CLUSTERS["tetrahedra"]))}


def test_added_goals_that_may_be_unstable_are_refused(particles):
    asked = ShapeMatching(mode="linear", goals="sum", clusters=CLUSTERS["each_tetrahedron"])
    most = make_clusters(particles, asked.clusters).shared_by.max()
    with pytest.raises(InputError, match=f"below {4 / most:.3g} only; lower alpha"):
        shape_matching.make(particles, asked)
    assert shape_matching.make(particles, asked.but(alpha=3.9 / most)).alpha == pytest.approx(3.9)


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
    cases = [("rigid", shear, False), ("linear", shear, True), ("quadratic", shear, True)]
    for mode, x, follows in [*cases, ("linear", bend, False), ("quadratic", bend, True)]:
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
@pytest.mark.parametrize("kind", KINDS)
def test_no_position_puts_goals_off(particles, mode, kind):
    effect = matched(particles, mode, kind)
    size = particles.size
    factors = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 1, 1], [-1, -1, -1], [1e-12, 1, 1], [1e-200, 0, 0], [50, 50, 50]]
    for factor in factors:
        x = particles.nodes * np.array(factor, dtype=float)
        found = goals(effect, x)
        assert np.isfinite(found).all()
        assert np.ptp(found, axis=0).max() < 2.5 * max(size, np.ptp(x, axis=0).max())
    heap = np.random.default_rng(0).uniform(-10 * size, 10 * size, particles.nodes.shape)
    assert np.ptp(goals(effect, heap), axis=0).max() < 25 * size


def test_the_answer_does_not_depend_on_the_one_before(particles):
    random = np.random.default_rng(2)
    used, x = matched(particles, "quadratic", "cubes"), particles.nodes
    for _ in range(50):
        x = x + 0.02 * random.normal(size=x.shape)
        assert np.abs(goals(used, x) - goals(matched(particles, "quadratic", "cubes"), x)).max() < 1e-12


@pytest.fixture(scope="module")
def volume(slab):
    return particles_of(slab, 1, surface=False)


@pytest.fixture(scope="module")
def surface(slab):
    return particles_of(slab, 1, surface=True)


def groups(clusters):
    return [clusters.members[a:b] for a, b in zip(clusters.starts[:-1], clusters.starts[1:], strict=True)]


def test_one_takes_each_piece_of_a_body(surface):
    found = groups(make_clusters(merge_particles([surface] * 2, [[0, 0, 0], [1, 1, 1]], "two"), CLUSTERS["one"]))
    count = len(surface.nodes)
    assert [g.tolist() for g in found] == [list(range(count)), list(range(count, 2 * count))]


def test_every_tetrahedron_lies_inside_a_cluster(volume):
    clusters = make_clusters(volume, CLUSTERS["tetrahedra"])
    found = groups(clusters)
    assert 1 < len(found) < len(volume.tetrahedra) / 4
    inside = [np.isin(volume.tetrahedra, group).all(axis=1) for group in found]
    assert np.any(inside, axis=0).all()
    assert clusters.shared_by.max() > 1


def test_to_the_letter_each_tetrahedron_has_a_cluster_of_all_around_it(volume):
    clusters = make_clusters(volume, CLUSTERS["each_tetrahedron"])
    found = groups(clusters)
    assert len(found) == len(volume.tetrahedra)
    for own, group in zip(volume.tetrahedra, found, strict=True):
        around = volume.tetrahedra[np.isin(volume.tetrahedra, own).any(axis=1)]
        assert set(group) == set(around.ravel())
    covered = {tuple(g) for g in groups(make_clusters(volume, CLUSTERS["tetrahedra"]))}
    assert covered < {tuple(g) for g in found}


def test_cubes_are_as_small_and_overlap_as_much_as_asked(volume):
    for edge, overlap in ((0.08, 0.5), (0.06, 0.3), (0.5, 0.0)):
        found = groups(make_clusters(volume, Clusters(kind="cubes", edge_m=edge, overlap=overlap)))
        assert all(np.ptp(volume.nodes[g], axis=0).max() <= edge * (1 + 1e-8) for g in found)
        assert np.array_equal(np.unique(np.concatenate(found)), np.arange(len(volume.nodes)))
        assert (len(found) == 1) == (edge == 0.5)


@pytest.mark.parametrize(
    ("edge_m", "overlap", "says"),
    [(0.1, 1.0, "overlap"), (1e-9, 0.5, "too many cubes"), (0.026, 0.0, "hold the body together")],
)
def test_cubes_that_are_unusable_are_refused(volume, edge_m, overlap, says):
    with pytest.raises(InputError, match=says):
        make_clusters(volume, Clusters(kind="cubes", edge_m=edge_m, overlap=overlap))


def test_tetrahedra_need_tetrahedra_around_every_particle(volume, surface):
    with pytest.raises(InputError, match="use cubes"):
        make_clusters(surface, CLUSTERS["tetrahedra"])
    spare = replace(volume, nodes=np.vstack([volume.nodes, [[9.0, 9.0, 9.0]]]))
    with pytest.raises(InputError, match="no tetrahedron"):
        make_clusters(spare, CLUSTERS["tetrahedra"])
