"""Hard cases end as they were declared to, and their bounds fail wrong answers."""

import pytest

from palpate.studies.hard_cases.declared import FAMILIES, declared
from palpate.studies.hard_cases.stage import NEARLY, WRONG, judge

QUICK = {
    "enrichment": (
        "duplicate_samples one_sample one_sample_fitted zero_width infinite_width far_query collinear_features "
        "tiny_features huge_features tiny_query huge_query more_samples_than_features near_singular body_at_rest"
    ),
    "fem": (
        "stiffness_contrast slivers half_turn unanchored_static unanchored_thrown single_tetrahedron "
        "joined_by_one_node_as_mesh joined_by_one_node_thrown stretch_at_0.488 thrice_the_load inverted_start "
        "start_line each_law_inverting_force each_law_from_inside_out stiffening_pulled "
        "regions_of_contrast_1e6 column_at_1_solved column_at_1.4_asked"
    ),
    "contact": (
        "deep_in_each_other instrument_inside pushed_out_of_instrument dented_by_instrument edge_along_edge "
        "instrument_through_thin_wall fall_in_steps_of_0.1_s spike_on_spike wedge_in_crack touch_at_a_node "
        "touch_at_an_edge touch_on_a_face touch_at_a_corner touch_in_a_groove touch_two_1_mm_apart "
        "touch_larger_than_the_body touch_tiny touch_capsule touch_sharp_punch "
        "touch_depth_negative touch_radius_nan touch_beside_the_body"
    ),
    "cuts": "cut_along_held cut_free_piece cut_free_piece_weighs cut_outside",
    "organ": "ct_thick_slices ct_noise ct_of_one_value",
    "dynamics": (
        "step_of_1e-5_s step_of_5e-4_s step_of_2_s goals_step_of_2_s mass_ratio twisted_10_turns stiff stiff_refused "
        "stiff_unstable flat_rest_point flat_rest_line flat_rest_plane one_particle "
        "modes_incompressible maxwell_times plastic_flow body_springs_from_point"
    ),
}
"""The cases of each family that take less than a second together with all their models."""


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=case.name, marks=[] if case.name in QUICK[family].split() else pytest.mark.slow)
        for family in FAMILIES
        for case in declared([family])
    ],
)
def test_hard_case(case):
    rows = [judge(case, model) for model in case.models]
    assert [row for row in rows if not row["passed"]] == []
    answered = [row for row in rows if row["sharp"] is not None]
    assert all(row[wrong] > row["bound"] for row in answered for wrong in WRONG)
    passes = {row["model"] for row in answered if row[NEARLY] <= row["bound"]}
    assert passes <= set(case.blunt)  # a bound that can fail an answer that is 5 % off does


def test_quick_cases_exist():
    assert {name for names in QUICK.values() for name in names.split()} <= {case.name for case in declared(list(QUICK))}
