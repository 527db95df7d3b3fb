"""The contact effect by itself: derivatives, limits, its table of contacts, and the pairs that can touch."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.particles import merge_particles
from palpate.collision.contact import push_apart
from palpate.collision.contact.barrier import barrier
from palpate.collision.contact.barrier_contact import make
from palpate.effects.settings import Ball, Contact, Floor
from palpate.errors import InputError
from palpate.linalg.block_pattern import gather

BALL = Ball(name="ball", center_m=[0.05, 0.04, 0.125], radius_m=0.02)
FLOOR = Floor(name="ground", height_m=-0.005)
GAP = 0.01


@pytest.fixture(scope="module")
def pair(cube):
    return merge_particles([cube(2), cube(1)], [[0, 0, 0], [0.105, 0.01, 0.02]], "pair")


@pytest.fixture(scope="module")
def contact(pair):
    found = make(pair, Contact(instruments=[BALL, FLOOR], gap_m=GAP, friction=0.4, slip_m_s=0.05), None)
    found.hold(np.array([3, 7]))
    return found


@pytest.fixture(scope="module")
def slid(pair, contact):
    """Move positions slightly from the start of a step of 0.1 s, so that there is friction."""
    rng = np.random.default_rng(3)
    start = pair.nodes + 0.001 * rng.normal(size=pair.nodes.shape)
    contact.at(0.1)
    assert contact.begin(start, 0.1) is start  # no obstacle has moved into it
    return start + 0.001 * rng.normal(size=start.shape)


def force_of(contact, x):
    force = np.zeros_like(x)
    contact.add_force(x, force, force)
    return force


def differences(function, x, step):
    rows = []
    for i in range(x.size):
        away = np.zeros(x.size)
        away[i] = step
        rows.append((function(x + away.reshape(x.shape)) - function(x - away.reshape(x.shape))) / (2.0 * step))
    return np.array(rows)


def test_force_and_stiffness_are_the_derivatives(pair, contact, slid):
    force = force_of(contact, slid)
    assert (np.abs(force).max(axis=1) > 0.0).sum() > 15
    slope = differences(contact.energy, slid, 1e-8).reshape(slid.shape)
    assert np.abs(force + slope).max() < 1e-5 * np.abs(force).max()
    exact = gather([contact.touching(slid, False)], len(slid)).toarray()
    slope = -differences(lambda x: force_of(contact, x).ravel(), slid, 1e-8)
    # stencils with both parts held are left out, as they cannot move
    free = np.delete(np.arange(len(slid)), [3, 7])
    free = (3 * free[:, None] + np.arange(3)).ravel()
    error = np.abs(exact - slope)[np.ix_(free, free)]
    assert error.max() < 1e-4 * np.abs(exact).max()
    definite = gather([contact.touching(slid, True)], len(slid)).toarray()
    assert np.linalg.eigvalsh(definite)[0] > -1e-9 * np.abs(definite).max()


def test_forces_among_all_points_add_up_to_nothing(contact, slid):
    forces = contact.forces(slid)
    assert np.abs(forces.sum(axis=0)).max() < 1e-12 * np.abs(forces).max()


def test_energy_is_infinite_where_anything_touches(pair, contact, slid):
    x = slid.copy()
    x[0] = np.add(BALL.center_m, [0.0, 0.0, -0.0199])
    assert contact.energy(x) == np.inf and np.isfinite(contact.energy(slid))


def test_a_limited_motion_intersects_nothing(pair, contact, slid):
    rng = np.random.default_rng(5)
    for size in 10.0 ** np.arange(-4, 5):
        way = size * rng.normal(size=slid.shape)
        part = contact.limit(slid, way)
        assert 0.0 < part <= 1.0
        for t in np.linspace(0.0, 1.0, 11):
            assert np.isfinite(contact.energy(slid + t * part * way))
    assert contact.limit(slid, np.zeros_like(slid)) == 1.0
    assert contact.limit(slid, np.full_like(slid, [0.0, 0.0, 1e-9])) == 1.0


def test_one_contact_in_closed_form(cube):
    """A corner over the floor: position, normal, gap and force."""
    body = cube(1)
    x = body.nodes @ np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    lowest = int(np.argmin(x[:, 2]))
    x += np.array([0.3, 0.2, 0.006]) - x[lowest]
    contact = make(body, Contact(instruments=[FLOOR.but(height_m=0.0)], gap_m=0.009), None)
    contact.begin(x, 0.1)
    contact.relax(x, 0.1)
    (row,) = contact.contacts(x).to_dict("records")
    scale, s = body.material.young_pa * body.areas[lowest], 0.006 / 0.009
    expected = scale * (2.0 * (s - 1.0) * np.log(s) + (s - 1.0) ** 2 / s)
    assert (row["first"], row["second"]) == ("cube", "ground")
    assert [row[f"{axis}_m"] for axis in "xyz"] == pytest.approx([0.3, 0.2, 0.003], abs=1e-12)
    assert [row[f"normal_{axis}"] for axis in "xyz"] == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)
    assert row["gap_m"] == pytest.approx(0.006, rel=1e-12)
    assert row["force_n"] == pytest.approx(expected, rel=1e-9)
    assert contact.energy(x) == pytest.approx(scale * 0.009 * barrier(s)[0], rel=1e-9)
    seen = contact.observe(x)
    assert [seen[f"ground_force_{axis}_n"] for axis in "xyz"] == pytest.approx([0.0, 0.0, -expected], abs=1e-9)
    assert force_of(contact, x)[lowest] == pytest.approx([0.0, 0.0, expected], abs=1e-9)


def test_contacts_carry_the_relative_velocity_of_the_step(cube):
    """A cube that turns and moves under a ball that moves: the first's velocity at the contact less the other's."""
    body, h = cube(2), 1e-3
    ball = BALL.but(center_m=[0.07, 0.06, 0.126], times_s=[0.0, 1.0], shifts_m=[[0, 0, 0], [0.3, 0, 0]])
    contact = make(body, Contact(instruments=[ball], gap_m=0.008), None)
    columns = [f"velocity_{axis}_m_s" for axis in "xyz"]
    still = contact.contacts(body.nodes)
    assert len(still) and not still[columns].to_numpy().any()

    def moving(places):
        return np.cross([1.0, 2.0, -3.0], places) + np.array([0.2, -0.1, 0.4])

    contact.at(h)
    contact.begin(body.nodes - h * moving(body.nodes), h)
    table = contact.contacts(body.nodes)
    (face,) = table[(table.gap_m - 0.006).abs() < 1e-9].to_dict("records")
    assert (face["first"], face["second"]) == ("cube", "ball")
    expected = moving([0.07 + 0.3 * h, 0.06, 0.1]) - [0.3, 0.0, 0.0]
    assert [face[column] for column in columns] == pytest.approx(expected, abs=1e-9)


def test_a_ball_beside_a_face_in_closed_form(cube):
    body = cube(2)
    ball = BALL.but(center_m=[0.07, 0.06, 0.126])
    contact = make(body, Contact(instruments=[ball], gap_m=0.008), None)
    contact.begin(body.nodes, 0.1)
    contact.relax(body.nodes, 0.1)
    table = contact.contacts(body.nodes)
    face = table[(table.gap_m - 0.006).abs() < 1e-9]
    assert len(face) == 1 and (table.gap_m >= 0.006 - 1e-12).all()
    assert face[["x_m", "y_m", "z_m"]].to_numpy()[0] == pytest.approx([0.07, 0.06, 0.103], abs=1e-12)
    normals, seen = table[["normal_x", "normal_y", "normal_z"]].to_numpy(), contact.observe(body.nodes)
    assert (table["first"] == "cube").all() and (table["second"] == "ball").all()
    total = -table["force_n"].to_numpy() @ normals  # a normal points to the first
    assert [seen[f"ball_force_{axis}_n"] for axis in "xyz"] == pytest.approx(total, abs=1e-12)


def test_which_pieces_can_touch(cube, pair):
    contact = make(pair, Contact(instruments=[BALL, FLOOR]), None)
    assert contact.names == ["cube_0", "cube_1", "ball", "ground"]
    expected = np.ones((4, 4), dtype=bool)
    expected[[0, 1], [0, 1]] = False
    expected[2:, 2:] = False
    assert np.array_equal(contact._can_touch, expected)
    assert make(pair, Contact(self_contact=True), None)._can_touch.all()
    assert make(cube(1), Contact(), None).names == ["cube"]


@pytest.mark.parametrize("apart", [0.11, 100.0])
def test_the_gap_follows_the_smallest_piece_wherever_it_is(cube, apart):
    pair = merge_particles([cube(2), cube(1, side=0.04)], [[0, 0, 0], [apart, 0, 0]], "pair")
    assert make(pair, Contact(), None).gap_m == pytest.approx(4e-5)
    assert make(pair, Contact(gap_m=0.003), None).gap_m == 0.003
    for gap in (0.0041, 3e-9):
        with pytest.raises(InputError, match=r"^cube: contact.gap_m is .* 0.04 m long; give from 4e-09 to 0.004, or"):
            make(pair, Contact(gap_m=gap), None)


def test_nothing_near_nothing_done(cube):
    body = cube(1)
    contact = make(body, Contact(instruments=[FLOOR.but(height_m=-1.0)]), None)
    x, v = body.nodes - [0.0, 0.0, 1e-4], np.full_like(body.nodes, [0.0, 0.0, -0.1])
    ended, kept = x.copy(), v.copy()
    contact.at(1e-3)
    contact.project(body.nodes, ended, kept, 1e-3)
    assert np.array_equal(ended, x) and np.array_equal(kept, v)
    assert contact.energy(x) == 0.0 and not force_of(contact, x).any() and contact.contacts(x).empty


def test_projecting_is_the_nearest_place(cube):
    """Pressed below the floor, with the masses' forces in balance with the barrier's."""
    body = cube(2)
    contact = make(body, Contact(instruments=[FLOOR], gap_m=1e-3), None)
    h, down = 0.01, np.array([0.0, 0.0, -0.05])
    x, v = body.nodes + down, np.tile(down / h, (len(body.nodes), 1))
    contact.at(h)
    contact.project(body.nodes, x, v, h)
    assert x[:, 2].min() > FLOOR.height_m
    unbalanced = force_of(contact, x) - (body.masses / h**2)[:, None] * (x - body.nodes - down)
    assert np.abs(unbalanced).max() < 1e-6 * np.abs(force_of(contact, x)).max()
    assert v == pytest.approx((x - body.nodes) / h, abs=1e-12)


PUSH_APART_BALL = BALL.but(center_m=[0.05, 0.05, 0.11])


def placed(play, parts, shifts, push_out=True, **contact):
    """Return the motion of three steps without weight, and its first and last frame."""
    motion = play(parts, shifts, steps=3, held=True, contact=Contact(push_out=push_out, **contact)).motion
    return motion, motion.positions[0], motion.positions[-1]


def test_two_boxes_part_along_their_least_overlap(play, cube, trespass):
    motion, first, _ = placed(play, [cube(2)] * 2, [[0, 0, 0], [0.01, 0.02, 0.06]])
    lower, upper = first[:27], first[27:]
    # equal masses: each goes half of the 4 cm and the gap, and neither is deformed
    assert upper[:, 2].min() - lower[:, 2].max() == pytest.approx(1e-4, rel=0.3)
    np.testing.assert_allclose(lower - cube(2).nodes, np.broadcast_to([0, 0, -0.02005], (27, 3)), atol=2e-5)
    assert trespass(motion)[1] == 0


def test_the_lighter_one_goes_and_a_held_one_stays(play, cube):
    heavy = replace(cube(1), masses=99.0 * cube(1).masses)
    _, first, _ = placed(play, [cube(1), heavy], [[0, 0, 0], [0, 0, 0.09]])
    ways = np.abs(first - np.vstack([heavy.nodes, heavy.nodes + np.array([0, 0, 0.09])]))[[0, -1], 2]
    assert ways[0] == pytest.approx(99.0 * ways[1], rel=1e-6)
    held = cube(1, held=np.array([0]))
    _, first, _ = placed(play, [cube(1), held], [[0, 0, 0], [0, 0, 0.09]])
    np.testing.assert_array_equal(first[8:], held.nodes + np.array([0, 0, 0.09]))


def test_a_body_rises_from_a_floor_and_leaves_a_ball(play, cube, trespass):
    motion, first, _ = placed(play, [cube(1)], [[0, 0, 0]], instruments=[FLOOR.but(height_m=0.02)])
    assert first[:, 2].min() == pytest.approx(0.0201, rel=1e-2)
    np.testing.assert_array_equal(first[:, :2], cube(1).nodes[:, :2])
    motion, first, _ = placed(play, [cube(2)], [[0, 0, 0]], instruments=[PUSH_APART_BALL])
    assert first[:, 2].max() == pytest.approx(0.09, abs=3e-4)
    assert trespass(motion)[0] > 0.0


@pytest.mark.parametrize(
    ("parts", "shifts", "contact", "sentence"),
    [
        ([[0], [0]], [[0, 0, 0], [0, 0, 0.05]], {}, "intersects .* since push_out found no way out"),
        ([range(7)], [[0, 0, 0]], {"instruments": [PUSH_APART_BALL]}, "push_out: ball is driven into held nodes"),
    ],
)
def test_what_cannot_move_is_refused(play, cube, parts, shifts, contact, sentence):
    with pytest.raises(InputError, match=rf"^scenes.played: .*{sentence}"):
        placed(play, [cube(1, held=np.array(held)) for held in parts], shifts, **contact)


def test_nothing_changes_where_nothing_overlaps_and_nothing_is_pushed_unless_asked(play, cube):
    _, first, _ = placed(play, [cube(1)] * 2, [[0, 0, 0], [0, 0, 0.2]])
    np.testing.assert_array_equal(first, np.vstack([cube(1).nodes, cube(1).nodes + np.array([0, 0, 0.2])]))
    with pytest.raises(InputError, match="move them apart"):
        placed(play, [cube(1)] * 2, [[0, 0, 0], [0, 0, 0.05]], push_out=False)


def test_the_way_is_the_shortest_between_the_hulls(cube):
    nodes, faces = cube(1).nodes, cube(1).triangles
    none, surfaces = np.zeros(0), [faces, faces + len(nodes)]
    movable = push_apart.Movable([], [], surfaces, np.zeros(2), np.zeros(2, dtype=bool), none, none, 0.001)
    points = np.vstack([nodes, nodes + np.array([0.07, 0.02, 0.01])])
    np.testing.assert_allclose(push_apart.shortest_separation(points, movable, (0, 1)), [-0.031, 0, 0], atol=1e-12)
