"""Pictures are embedded at their natural size."""

import numpy as np
import pytest
from PIL import Image

from palpate.errors import InputError
from palpate.report import markup

SVG = '<svg xmlns:xlink="x"\n height="216pt" version="1.1" width="360.0pt" viewBox="0 0 360 216"></svg>'


@pytest.fixture
def folder(tmp_path):
    """Two figures: ``plain`` is small, the SVG of ``rich`` is too large."""
    (tmp_path / "plain.svg").write_text(SVG)
    (tmp_path / "rich.svg").write_text(SVG + " " * 300_000)
    pixels = np.random.default_rng(0).integers(0, 255, (160, 320, 3), dtype=np.uint8)
    for name in ("plain", "rich"):
        Image.fromarray(pixels).save(tmp_path / f"{name}.png")
    return tmp_path


def test_a_small_drawing_stays_one(folder):
    text = markup.image(folder / "plain", "a & b")
    assert 'alt="a &amp; b" width="480" height="288" src="data:image/svg+xml;base64,' in text


def test_a_large_drawing_becomes_a_picture_of_the_same_size(folder):
    text = markup.image(folder / "rich", "")
    assert 'width="192" height="96" src="data:image/webp;base64,' in text


def test_a_narrow_screen_gets_a_picture_of_its_own(folder):
    text = markup.figure(folder, "rich", "<p>caption</p>", small="plain")
    assert '<picture><source media="(max-width: 44rem)" srcset="data:image/svg+xml' in text
    assert "<picture>" not in markup.figure(folder, "rich", "")


def test_a_figure_links_to_nothing(folder):
    assert "href" not in markup.figure(folder, "plain", "")


def test_a_missing_figure_is_named(folder):
    with pytest.raises(InputError, match=r"nothing\.svg is missing"):
        markup.image(folder / "nothing", "")
