"""Tables and captions become HTML that can be read on any screen, and pictures are embedded at their natural size."""

import base64
from io import BytesIO

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


def test_a_drawing_of_few_colours_loses_nothing(folder):
    pixels = np.full((160, 320, 3), 255, dtype=np.uint8)
    pixels[::7, :, 1], pixels[:, ::5, 2] = 0, 30
    Image.fromarray(pixels).save(folder / "rich.png")
    packed = markup.image(folder / "rich", "").partition("base64,")[2].rstrip('">')
    assert (np.asarray(Image.open(BytesIO(base64.b64decode(packed)))) == pixels).all()
