"""What the report says of laws follows from their table."""

from fixtures.material import numbers


def test_what_has_no_truth_is_marked(law_table):
    known = law_table["poisson"].ne(0.49)
    doubted = law_table.assign(believed=law_table["believed"] & known)
    doubted["own_rmse_of_peak"] = law_table["own_rmse_of_peak"].where(known, 0.016)
    assert numbers("law", {"law": doubted})["doubted"] == "ν = 0.49 (1.6 %)"
    assert numbers("law", {"law": law_table})["doubted"] == "none"
