"""Only free nodes of the coarse surface can be pressed, and every other node is refused by its number."""

import numpy as np
import pytest
from scipy.spatial.distance import cdist, pdist

from palpate.bodies.contacts import contacts_of, kept_contacts, pressed_contacts, row_of
from palpate.errors import InputError


def test_free_surface_nodes_have_their_rows(slab):
    contacts = contacts_of(slab)
    assert contacts.tolist() == [node for node in slab.coarse.surface if node not in slab.anchors[0]]
    assert [row_of(contacts, int(node)) for node in contacts] == list(range(len(contacts)))


@pytest.mark.parametrize("which", ["held", "inside", "far", "negative"])
def test_other_nodes_are_refused(slab, which):
    contact = {
        "held": slab.anchors[0][0],
        "inside": np.setdiff1d(np.arange(len(slab.coarse.nodes)), slab.coarse.surface)[0],
        "far": len(slab.coarse.nodes),
        "negative": -1,
    }[which]
    with pytest.raises(InputError, match=rf"^slab, contact {contact} is not a free surface node of the mesh"):
        row_of(contacts_of(slab), int(contact), "slab, ")


def test_without_a_count_all_are_kept(slab):
    assert np.array_equal(kept_contacts(slab, None), contacts_of(slab))


def test_kept_contacts_are_pressed_ones_and_no_more_than_there_are(slab):
    able = pressed_contacts(slab, contacts_of(slab))
    assert np.array_equal(kept_contacts(slab, 1000), able)
    few = kept_contacts(slab, 7)
    assert len(few) == 7 and (np.diff(few) > 0).all() and np.isin(few, able).all()
    assert np.isin(kept_contacts(slab, 6), few).all()


def test_kept_contacts_are_spread_evenly(beam):
    """No contact is farther from a kept one than those are from each other, and chance leaves larger gaps."""

    def gap(kept):
        return cdist(beam.coarse.nodes[able], beam.coarse.nodes[kept]).min(axis=1).max()

    able = pressed_contacts(beam, contacts_of(beam))
    kept = kept_contacts(beam, 20)
    assert gap(kept) <= pdist(beam.coarse.nodes[kept]).min() * (1 + 1e-12)
    random = np.random.default_rng(1)
    assert gap(kept) < 0.7 * np.mean([gap(random.choice(able, 20, replace=False)) for _ in range(50)])
