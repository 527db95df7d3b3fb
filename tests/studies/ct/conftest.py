"""A small CT scan with an organ in it."""

import numpy as np
import pytest

from palpate.bodies.ct.image import Image


@pytest.fixture(scope="session")
def scan():
    """A cylinder of muscle in a skin, with a bone behind and a ball of organ in front of it, 0.08 m wide."""
    shape, spacing = (20, 40, 40), np.array([0.002, 0.002, 0.004])
    image = Image(np.full(shape, -1000, dtype=np.int16), -(np.array(shape[::-1]) - 1) / 2 * spacing, spacing)
    x, y, z = np.moveaxis(image.to_world(np.stack(np.indices(shape), axis=-1)), -1, 0)
    image.hu[np.hypot(x, y) < 0.036] = -100
    image.hu[np.hypot(x, y) < 0.032] = 50
    image.hu[np.hypot(x, y - 0.02) < 0.006] = 700
    mask = x**2 + (y + 0.008) ** 2 + z**2 < 0.018**2
    image.hu[mask] = 60
    return image, mask
