"""Claims on masses are judged for every body from a CT."""

import pandas as pd

from palpate.studies.ct.claims import node_masses


def table(raw, own, density):
    rows = zip([600, 9000], raw, own, density, strict=True)
    names = ["elements", "raw_deviation", "deviation_from_voxels", "mean_density_kg_m3"]
    return {"node_mass": pd.DataFrame(rows, columns=names).assign(body="my_liver")}


def test_masses_as_the_paper_has_them_confirm_it():
    found = list(node_masses(table([-0.03, -0.007], [0.02, 0.002], [1065.0, 1066.0])))
    assert [claim.verdict for claim in found] == ["confirmed"] * 4
    assert found[1].ours == "my liver 2.3 %"


def test_others_refute_it():
    found = node_masses(table([-0.11, -0.2], [0.02, -0.02], [1065.0, 1100.0]))
    assert [claim.verdict for claim in found] == ["refuted"] * 4
