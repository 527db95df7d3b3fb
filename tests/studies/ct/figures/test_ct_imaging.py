"""The figure on imaging has a picture of each kind and a line for each body."""

import numpy as np

from palpate.bodies.ct.image import Image
from palpate.report import style
from palpate.studies.ct import figures
from palpate.studies.ct.imaging import Pictures


def test_pictures_and_lines_are_drawn(ct_results, tmp_path):
    pictures = {name: np.full((30, 40, 3), 0.5) for name in ("a", "b", "c")}
    image = Image(np.full((5, 20, 30), 7, dtype=np.int16), np.zeros(3), np.full(3, 0.002), modality="mri")
    liver = np.zeros(image.hu.shape, dtype=bool)
    liver[1:4, 5:15, 5:20] = True
    shown = Pictures(pictures, np.full((30, 40), 0.4), [(image, liver), (image, ~liver & False)], liver)
    figure = figures.draw_ct_imaging(shown, ct_results["mask_interpolation"])
    titles = [axis.get_title(loc="left") for axis in figure.axes]
    assert titles[:4] == ["a", "b", "c", "samples taken of each ray"]
    lines = figure.axes[-1] if figure.axes[-1].get_xlabel() == "n" else figure.axes[-2]
    assert [line.get_ydata().tolist() for line in lines.lines[:2]] == [[0.99, 0.97], [0.9, 0.85]]
    style.save(figure, tmp_path / "ct_imaging")
