"""Contacts drawn by area, as likely anywhere on the surface."""

import numpy as np

from palpate.bodies.body import nest
from palpate.bodies.contacts import contacts_by_area, contacts_of, kept_contacts, pressed_contacts, sampled_contacts
from palpate.bodies.simple_shapes import cylinder


def test_contacts_are_drawn_as_often_as_they_are_large(soft):
    """The free end of the cylinder, whose middle the farthest points leave out, has its share of 4000 draws."""
    mesh = cylinder(0.2, 0.03)
    body = nest("cylinder", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] < 1e-9), soft)
    able = pressed_contacts(body, contacts_of(body))
    drawn = np.concatenate([contacts_by_area(body, 10, seed) for seed in range(400)])
    assert np.isin(drawn, able).all()
    inside = np.hypot(*mesh.nodes[:, :2].T) < 0.029
    ends = float(np.mean(inside[drawn]))
    corners = mesh.triangles
    areas = 0.5 * np.linalg.norm(
        np.cross(*(mesh.nodes[corners[:, i]] - mesh.nodes[corners[:, 0]] for i in (1, 2))), axis=1
    )
    share = np.bincount(corners.ravel(), np.repeat(areas / 3.0, 3), minlength=len(mesh.nodes))
    assert abs(ends / (share[able][inside[able]].sum() / share[able].sum()) - 1.0) < 0.15
    assert len(np.unique(contacts_by_area(body, 10, 1))) == 10
    assert len(contacts_by_area(body, 10_000, 1)) == len(able)


def test_half_of_the_sampled_contacts_are_spread_and_none_is_taken_twice(beam):
    for count in (1, 2, 7, 20):
        sampled = sampled_contacts(beam, count, 1)
        assert len(np.unique(sampled)) == count and (np.diff(sampled) > 0).all()
        assert np.isin(kept_contacts(beam, -(-count // 2)), sampled).all()
        assert np.isin(sampled, sampled_contacts(beam, count + 1, 1)).all()
    others = [frozenset(sampled_contacts(beam, 20, seed).tolist()) for seed in range(5)]
    assert len(set(others)) == 5
    able = pressed_contacts(beam, contacts_of(beam))
    assert np.array_equal(sampled_contacts(beam, 10_000, 1), able)
