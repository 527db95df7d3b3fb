"""Scaling is drawn with its exponents, and told in sentences."""

import matplotlib.text
import numpy as np
import pandas as pd
import pytest

from palpate.figures import style
from palpate.figures.scaling import scaling
from palpate.report.parts import scaling_numbers


@pytest.fixture(scope="module")
def table():
    rows = []
    for kernel in scaling.KERNELS:
        for size in (1, 2) if kernel == "cores" else (1000, 10_000, 100_000, 1_000_000):
            for stage in ("respond", "mesh"):
                seconds = 1.0 / size if kernel == "cores" else 2e-5 * size
                row = {"kernel": kernel, "unit": f"units of {kernel}", "size": size, "stage": stage, "seconds": seconds}
                powers = {"seconds_exponent": 1.07, "memory_exponent": 0.99 if kernel != "cores" else np.nan}
                rows.append(row | {"memory_mb": 5e-3 * size, "threads": 1} | powers)
    return pd.DataFrame(rows)


def test_each_kernel_has_a_panel_with_exponents(table, tmp_path):
    figure = scaling.draw(table)
    titles = [axis.get_title(loc="left") for axis in figure.axes if axis.lines]
    assert titles == [*(title for title, _, _ in scaling.KERNELS.values()), "memory"]
    texts = [t.get_text() for t in figure.findobj(matplotlib.text.Text)]
    assert texts.count("respond: n$^{1.07}$") == len(scaling.KERNELS)
    style.save(figure, tmp_path / "scaling")


def test_a_kernel_may_be_missing(table):
    figure = scaling.draw(table[table["kernel"] != "samples"])
    assert "enrichment, samples" not in [axis.get_title(loc="left") for axis in figure.axes]


def test_the_caption_names_the_largest_body(table):
    said = scaling_numbers.numbers({"scaling": table})
    assert said["scaling_elements"] == "1,000,000"
    assert said["headline_scaling"] == (
        "A press of 1,000,000 tetrahedra takes 20\u00a0s and 5 GB on one core; "
        "the time grows with the elements to the power of 1.07."
    )
    assert said["scaling_whole"] == "to the power of 1.00"  # of all stages, proportional in this table
    assert said["scaling_cores"] == "2 cores are 2 times as fast as one"


def test_one_core_has_no_speed_up(table):
    assert (
        scaling_numbers.numbers({"scaling": table[(table["kernel"] != "cores") | (table["size"] == 1)]})[
            "scaling_cores"
        ]
        == "there is one core only"
    )
