"""Of an organ that a scan shows as a sheet there is no body."""

import numpy as np
import pytest

from palpate.bodies.ct.mesh_from_ct import THINNEST, refuse_thin
from palpate.bodies.ct.synthetic_abdomen import abdomen
from palpate.errors import InputError


@pytest.mark.parametrize(("axis", "name"), [(0, "z"), (1, "y"), (2, "x")])
def test_an_organ_of_three_slices_is_refused_and_one_of_four_is_not(axis, name):
    image = abdomen(spacing_m=(0.02, 0.02, 0.02))[0]
    for thick in (THINNEST - 1, THINNEST):
        mask = np.zeros(image.hu.shape, dtype=bool)
        sides = [slice(2, 12)] * 3
        sides[axis] = slice(3, 3 + thick)
        mask[tuple(sides)] = True
        if thick < THINNEST:
            with pytest.raises(InputError, match=f"the organ is 3 voxels thick along {name}, and 4 are"):
                refuse_thin(image, mask)
        else:
            refuse_thin(image, mask)
