"""Each figure is drawn from made-up tables, and parts of the report are written of them."""

from importlib import import_module

import numpy as np
import pandas as pd
import pytest
from fixtures.drawn import texts
from fixtures.material import page
from fixtures.trade_off import accuracy_vs_time

from palpate.benchmark.advice import ADVICE
from palpate.benchmark.engine_scores import ANSWERS
from palpate.report import declared
from palpate.studies.dynamic.forces import DYNAMIC_FORCE
from palpate.studies.dynamic.reference import DYNAMIC_REFERENCE

FIGURES = {name: figure for study in declared.names() for name, figure in declared.figures(study).items()}
ALONE = {
    "ct_slices", "ct_volume_rendering", "ct_imaging", "deformed_bodies", "error_over_body", "contact_force",
    "presses", "relaxation", "organ_springs", "outside", "palpation", "palpation_limits",
}  # fmt: skip
"""Figures that need more than these tables; the smoke run draws them."""
OPTIONS = {
    "cut_precision": {"scene": "liver_cut"},
    "cut_opening": {"scene": "liver_cut"},
    "touch_precision": {"scene": "liver_sphere_8mm"},
    "measured": {"scene": "beam"},
    "answers": {"scene": "cylinder_large"},
    "work_precision": {"scene": "liver_small"},
    "best_models": {"scene": "liver_small"},
    "sigma_sweep": {"published": {"sigma": {"value": 0.05, "unit_m": {"liver": 0.0308}}}},
}


@pytest.fixture
def every(request, trade_off_tables, dynamic_table):
    """All tables that are made up, by name."""
    found = dict(trade_off_tables)
    for part in ("results", "scene_results", "shape_matching_results", "spring_results", "collision_results"):
        found |= request.getfixturevalue(part)
    found |= request.getfixturevalue("ct_results")
    for name in ("measured", "hard_cases", "scaling", "law"):
        found[name] = request.getfixturevalue(f"{name}_table")
    for name in ("cut", "cut_opening", "cut_truth", "touch", "touch_truth"):
        found[name] = request.getfixturevalue(name)
    answer = dict.fromkeys(ANSWERS.columns, 0.1) | {"engine": "Elsewhere", "scene": "cylinder_large"}
    answer |= {"model": "Elsewhere", "setting": "fine", "version": "1", "hardware": "a card", "law": "corotational"}
    force = [{"scene": "liver_press", "model": m, "setting": s} for m, s in (("fem_p2", "limit"), ("springs", "h=1"))]
    force = [row | {"time_s": t, "force_z_n": 4 * t} for row in force for t in (0.1, 0.2)]
    reference = [
        {"scene": "bar_sag", "step_s": 0.02, "time_s": t, "change_of_peak": 0.04, "bound": 0.01, "resolved": t < 0.2}
        for t in (0.1, 0.2, 0.3)
    ]
    found |= {
        "answers": ANSWERS.frame([answer]),
        "dynamic_accuracy": dynamic_table.assign(force_rms_of_peak=dynamic_table["rmse_of_peak"]),
        "dynamic_force": pd.DataFrame(force, columns=DYNAMIC_FORCE.columns).fillna({"force_x_n": 0, "force_y_n": 0}),
        "dynamic_reference": pd.DataFrame(reference, columns=DYNAMIC_REFERENCE.columns),
    }
    return found


@pytest.mark.parametrize("name", sorted(FIGURES.keys() - ALONE))
def test_a_figure_is_drawn_of_its_tables(every, name):
    module, _, function = FIGURES[name].place.partition(":")
    draw = getattr(import_module(module), function)
    figure = draw(*(every[table] for table in FIGURES[name].tables), **OPTIONS.get(name, {}))
    drawn = [axis for axis in figure.axes if axis.has_data()]
    assert drawn and all(np.isfinite([*axis.get_xlim(), *axis.get_ylim()]).all() for axis in drawn)
    assert not [text for text in texts(figure) if "nan" in text.lower().split()]


@pytest.mark.parametrize(
    "study",
    ["collision", "cut", "dynamic", "hard_cases", "law", "measured", "shape_matching", "springs", "touch", "tradeoff"],
)
def test_a_part_of_the_report_has_a_number_wherever_it_names_one(every, study):
    tables = every | {"accuracy_vs_time": accuracy_vs_time()}
    if study == "dynamic":
        tables["advice"] = ADVICE.frame([])
        del tables["accuracy_vs_time"]
    published = {"source": "a paper", "fitness_m": -0.05, "generations": 1000, "seconds": 3600, "steps_1_s": 50}
    words = page(study, tables, published).split()
    assert len(words) > 100 and not {"nan", "None", "inf"} & set(words)
