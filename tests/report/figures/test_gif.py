"""Small looping files that keep time."""

import numpy as np
import pytest
from PIL import Image

from palpate.report import turnable


def seconds(path):
    """How long each picture of a GIF stays [s]."""
    with Image.open(path) as image:
        found = []
        for frame in range(image.n_frames):
            image.seek(frame)
            found.append(image.info["duration"] / 1000)
    return found


def squares(count):
    """A dark square that walks."""
    pictures = np.full((count, 40, 80, 3), 255, dtype=np.uint8)
    for i, picture in enumerate(pictures):
        picture[10:30, i : i + 20] = 40
    return list(pictures)


@pytest.mark.parametrize(("duration", "loop"), [(4.0, 4.0), (1.5, 1.5), (0.05, 1.0), (0.3, 1.5), (30.0, 6.0)])
def test_real_time_unless_too_short_or_too_long(tmp_path, duration, loop):
    times = np.linspace(0, duration, 31)
    turnable.write_gif(squares(31), times, tmp_path / "a.gif")
    lasting = seconds(tmp_path / "a.gif")
    assert sum(lasting[:-1]) == pytest.approx(loop, abs=0.02)
    assert lasting[-1] == pytest.approx(0.8)


def test_uneven_times_are_kept(tmp_path):
    turnable.write_gif(squares(3), np.array([0.0, 1.0, 4.0]), tmp_path / "a.gif")
    assert seconds(tmp_path / "a.gif") == pytest.approx([1.0, 3.0, 0.8])


def test_what_is_hard_to_compress_loses_frames_and_colours_but_no_time(tmp_path):
    noise = np.random.default_rng(0).integers(0, 256, (60, 160, 480, 3), dtype=np.uint8)
    turnable.write_gif(list(noise), np.linspace(0, 4, 60), tmp_path / "a.gif")
    assert (tmp_path / "a.gif").stat().st_size < 1_500_000
    lasting = seconds(tmp_path / "a.gif")
    assert len(lasting) < 60
    assert sum(lasting) == pytest.approx(4.8, abs=0.02)
