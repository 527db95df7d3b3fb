"""Only free nodes of the coarse surface can be pressed, and every other node is refused by its number."""

import numpy as np
import pytest

from palpate.bodies.contacts import contacts_of, row_of
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
    with pytest.raises(InputError, match=rf"^slab, contact {contact} is not a free surface node of the coarse mesh"):
        row_of(contacts_of(slab), int(contact), "slab, ")
