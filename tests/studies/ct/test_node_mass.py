"""Masses over resolutions: as good as asked, on the synthetic abdomen and on a real liver."""

import pandas as pd
import pytest

from palpate.bodies.ct.synthetic_abdomen import abdomen
from palpate.studies.ct import node_mass
from palpate.studies.ct.claims import node_masses


def test_a_coarse_scan_on_a_coarse_mesh_is_weighed_with_and_without_the_rim():
    image, truth = abdomen(spacing_m=(0.006, 0.006, 0.006))
    [row] = node_mass.measure("abdomen", image, truth["liver"], [140]).itertuples()
    assert row.total_mass_kg == pytest.approx(truth["mass_kg"], rel=0.02)
    assert row.deviation_from_voxels == pytest.approx(row.total_mass_kg / row.voxel_mass_kg - 1.0)
    assert row.raw_deviation < -0.02 and abs(row.deviation_from_voxels) < 0.02  # fat beside the organ is lighter


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
