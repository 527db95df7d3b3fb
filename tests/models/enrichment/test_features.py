"""What a contact sees: the same pattern in the same slots, nothing lost on the way back."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from palpate.errors import InputError
from palpate.models.enrichment.features import body_axis, contact_frame, features_of, nearest_first


def turned(db, angle):
    """A third of a turn about z maps the mesh to itself: node maps (coarse, fine) and the rotation."""
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    maps = []
    for nodes in (db.coarse_nodes, db.nodes_fine_surface):
        distance, image = cKDTree(nodes).query(nodes @ rotation.T)
        assert distance.max() < 1e-12
        maps.append(image)
    return *maps, rotation


@pytest.mark.parametrize(("name", "length"), [("unordered", 546), ("ordered", 30), ("framed", 30)])
def test_slots_and_back(db, name, length):
    view = features_of(db, name, 10).view(int(db.contact[3]))
    assert view.feature(db.coarse_paper[3]).shape == (length,)
    again = view.from_slots(view.to_slots(db.fine[3]))
    assert again == pytest.approx(db.fine[3], abs=1e-16)
    lengths = np.linalg.norm(view.to_slots(db.fine[3]).reshape(-1, 3), axis=1)
    assert np.sort(lengths) == pytest.approx(np.sort(np.linalg.norm(db.fine[3], axis=1)))


@pytest.mark.parametrize("name", ["ordered", "framed"])
def test_nearest_nodes_come_first(db, name):
    contact = int(db.contact[5])
    view = features_of(db, name, 10).view(contact)
    assert view.coarse[0] == contact
    for nodes, order in ((db.coarse_nodes, view.coarse), (db.nodes_fine_surface, view.slots)):
        distance = np.linalg.norm(nodes[order] - db.coarse_nodes[contact], axis=1)
        assert (np.diff(distance) > -1e-9 * db.size).all()
    others = np.setdiff1d(db.coarse_surface, view.coarse)
    nearest_other = np.linalg.norm(db.coarse_nodes[others] - db.coarse_nodes[contact], axis=1).min()
    furthest = np.linalg.norm(db.coarse_nodes[view.coarse[-1]] - db.coarse_nodes[contact])
    assert furthest <= nearest_other + 1e-9 * db.size


@pytest.mark.parametrize("place", [1, 3, 11, 30, 77, 120, 150, 175])
def test_framed_is_blind_to_a_turn_about_the_axis(db, place):
    contact = int(db.coarse_surface[place])
    coarse_map, fine_map, rotation = turned(db, 2 * np.pi / 3)
    coarse, fine = np.empty_like(db.coarse_paper[0]), np.empty_like(db.fine[0])
    coarse[coarse_map] = db.coarse_paper[0] @ rotation.T
    fine[fine_map] = db.fine[0] @ rotation.T
    framed = features_of(db, "framed", 10)
    here, there = framed.view(contact), framed.view(int(coarse_map[contact]))
    assert there.feature(coarse) == pytest.approx(here.feature(db.coarse_paper[0]), abs=1e-15)
    assert there.to_slots(fine) == pytest.approx(here.to_slots(db.fine[0]), abs=1e-15)


def test_a_contact_off_the_surface_is_refused(db):
    with pytest.raises(InputError, match="contact 100000 is not a coarse surface node"):
        features_of(db, "ordered", 10).view(100000)


def test_ties_go_by_number_and_framed_ones_by_position_whatever_the_rounding():
    angles = np.arange(12) * np.pi / 6
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(12)])
    frame = contact_frame(np.array([0.0, 0.0, 1.0]), np.eye(3))
    wanted = ring[nearest_first(ring, np.zeros(3), 2.0, frame)]
    for seed in range(20):
        random = np.random.default_rng(seed)
        noise = 1e-15 * random.normal(size=ring.shape)
        assert nearest_first(ring + noise, np.zeros(3), 2.0).tolist() == list(range(12))
        shuffled = random.permutation(ring) + noise
        found = shuffled[nearest_first(shuffled, np.zeros(3), 2.0, frame)]
        assert found == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("height", [0.1, 10.0])
def test_the_axis_of_a_body_of_revolution_is_its_own_and_a_cube_gets_one(height):
    angles = np.arange(24) * np.pi / 12
    points = np.array([[z, np.cos(a), np.sin(a)] for a in angles for z in np.linspace(0, height, 5)])
    assert body_axis(points) == pytest.approx([1, 0, 0], abs=1e-12)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    assert body_axis(corners).tolist() == [0, 0, 1]
