"""Every case of the poke has its curve and its share of moved nodes."""

import pandas as pd

from palpate.studies.shape_matching import figures


def test_every_case_is_named_with_its_share_of_moved_nodes(shape_matching_results):
    table = shape_matching_results["body_springs"]
    damped = table[table["case"] == "none"].assign(case="dampers_only")
    labels = [t.get_text() for t in figures.draw_body_springs(pd.concat([table, damped])).legends[0].get_texts()]
    assert len(labels) == 3
    held = table[(table["case"] == "none") & (table["phase"] == "hold") & (table["time_s"] == 1.0)]
    share = held["moved"].sum() / held["nodes"].sum()
    assert labels[0].startswith(f"surface springs only\n{100 * share:.0f} % of nodes moved")
