"""Tables and captions become HTML that can be read on any screen, and pictures are embedded at their natural size."""

import numpy as np
import pytest
from PIL import Image

from palpate.report import markup

SVG = '<svg xmlns:xlink="x"\n width="360.0pt" height="216pt" viewBox="0 0 360 216" version="1.1"></svg>'


@pytest.fixture
def folder(tmp_path):
    """Two figures: ``plain`` is small, the SVG of ``rich`` is too large."""
    (tmp_path / "plain.svg").write_text(SVG)
    (tmp_path / "rich.svg").write_text(SVG + " " * 300_000)
    pixels = np.random.default_rng(0).integers(0, 255, (160, 320, 3), dtype=np.uint8)
    for name in ("plain", "rich"):
        Image.fromarray(pixels).save(tmp_path / f"{name}.png")
    return tmp_path


def test_a_large_drawing_becomes_a_picture_of_the_same_size(folder):
    text = markup.image(folder / "rich", "")
    assert 'width="192" height="96" src="data:image/webp;base64,' in text
