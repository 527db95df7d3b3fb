"""What a law changes: in proportion to the load, nothing for the law itself, and rows for presses without an answer."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.accuracy import OWN, patch_nodes, truth_errors
from palpate.benchmark.presses import samples_in
from palpate.benchmark.truth import truth_of
from palpate.bodies.body import nest
from palpate.bodies.contacts import sampled_contacts
from palpate.bodies.material import Material, Tissue
from palpate.effects.patch_load import nodal_load
from palpate.report.tables import where
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.law.compare_laws import LAW_TABLE, compare_laws, crossing, from_depths, growing_presses, variants

pytestmark = pytest.mark.slow

LAWS = ["stable_neo_hookean", "neo_hookean", "st_venant_kirchhoff"]
RADIUS_M = 0.06


@pytest.fixture(scope="module")
def block(box, soft):
    """A box of 12 coarse elements, refined once, held at one end."""
    mesh = box([2, 1, 1], [0.2, 0.1, 0.1])
    return nest("block", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), soft)


@pytest.fixture(scope="module")
def loads(block):
    """Presses on the far corner, each half of the one before."""
    contact = block.coarse.surface[np.argmax(block.coarse.nodes[block.coarse.surface].sum(axis=1))]
    rows = [(i, contact, 0.0, 0.0, -force, RADIUS_M, 0.01) for i, force in enumerate([0.08, 0.04, 0.02])]
    names = ["sample", "contact", "force_x_n", "force_y_n", "force_z_n", "radius_m", "peak_of_size"]
    return pd.DataFrame(rows, columns=names)


@pytest.fixture(scope="module")
def table(block, loads):
    return compare_laws(block, loads, ["corotational", *LAWS], [0.3, 0.45], tolerance=1e-9)


def test_every_press_under_every_law(table):
    assert list(table.columns) == LAW_TABLE.columns and len(table) == 5 * 3
    assert list(dict.fromkeys(zip(table["changed"], table["law"], table["poisson"], strict=True))) == [
        ("nothing", "corotational", 0.3), *(("law", law, 0.3) for law in LAWS), ("poisson", "corotational", 0.45),
    ]  # fmt: skip
    assert table["believed"].all() and (table["why"] == "").all()


def test_a_law_changes_nothing_against_itself_and_poissons_ratio_at_any_load(table):
    own = where(table, changed="nothing")
    assert (own[["change_rmse_of_peak", "change_relative_l2", "change_patch_rms_of_peak"]] == 0.0).all(axis=None)
    assert (own["depth_of_size"] == own["peak_of_size"]).all()
    change = where(table, changed="poisson")["change_rmse_of_peak"].to_numpy()
    assert change[0] > 0.01 and change == pytest.approx(np.full(3, change[0]), rel=0.02)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("measure", ["rmse_of_peak", "relative_l2", "patch_rms_of_peak"])
def test_all_laws_are_one_for_small_loads(table, law, measure):
    """They have the same linear response, so that the relative change falls in proportion to the load."""
    change = where(table, law=law)[f"change_{measure}"].to_numpy()
    assert change[0] > 1e-4 and change[:-1] / change[1:] == pytest.approx([2.0, 2.0], rel=0.03)


def test_the_mesh_costs_the_same_under_every_law_and_at_every_depth(table):
    """At small loads: there the laws are one."""
    for mesh in ("linear", "quadratic", "finest"):
        errors = table[table["poisson"] == 0.3][f"{mesh}_rmse_of_peak"].to_numpy()
        assert errors == pytest.approx(np.full(12, errors[0]), rel=0.05)
    row = table.iloc[0]
    assert row["linear_rmse_of_peak"] > 2 * row["quadratic_rmse_of_peak"] > 4 * row["finest_rmse_of_peak"]


def test_the_numbers_are_those_of_both_answers(block, loads, table):
    """By hand, for one press: the distance of the limits, and of linear elements from theirs."""
    body = replace(block, material=replace(block.material, law="st_venant_kirchhoff"))
    own, other = (truth_of(each, samples_in(loads[:1]), (), tolerance=1e-9) for each in (block, body))
    patch = patch_nodes(block.fine, int(loads["contact"][0]), RADIUS_M)
    row = where(table, law="st_venant_kirchhoff").iloc[0]
    by_limits = truth_errors(other.displacement[0], own.displacement[0], patch)
    assert row["change_rmse_of_peak"] == pytest.approx(by_limits.rmse_of_peak, rel=0.03)
    solver, force = Equilibrium(body, 1), np.array([0.0, 0.0, -0.08])
    load = nodal_load(body, 1, int(loads["contact"][0]), force, RADIUS_M)
    linear = (solver.solve(load, 1e-9).x - solver.mesh.nodes)[body.fine.surface]
    assert row["linear_rmse_of_peak"] == pytest.approx(truth_errors(linear, other.displacement[0], patch).rmse_of_peak)
    assert row["own_rmse_of_peak"] == other.own[0, OWN.index("rmse_of_peak")] and row["force_n"] == 0.08
    peaks = [np.linalg.norm(each.displacement[0], axis=1).max() / block.fine.size for each in (own, other)]
    assert [row["depth_of_size"], row["peak_of_size"]] == pytest.approx(peaks)


@pytest.mark.parametrize("law", ["stable_neo_hookean", "neo_hookean"])
def test_what_is_nearly_incompressible_keeps_its_volume(block, loads, law):
    """The change of volume falls in proportion to 1 − 2 ν, and so to one over the bulk modulus.

    Only these laws are functions of the volume itself; the others hold a sum of stretches, which is no volume.
    """
    body = replace(block, material=replace(block.material, law=law))
    table = compare_laws(body, loads[2:], [], [0.45, 0.49, 0.499], tolerance=1e-7)
    assert table["poisson"].tolist() == [0.3, 0.45, 0.49, 0.499] and (table["law"] == law).all()
    lost = (table["volume_change"] / (1.0 - 2.0 * table["poisson"])).to_numpy()
    assert lost[0] < 0.0 and lost == pytest.approx(np.full(4, lost[0]), rel=0.15)


def test_a_press_without_an_answer_is_a_row_that_says_so(block, loads):
    """St. Venant-Kirchhoff tissue gives way where it is compressed, under a load that corotational tissue stands."""
    hard = loads[:1].assign(force_z_n=-2.0)
    own, lost = compare_laws(block, hard, ["st_venant_kirchhoff"], []).to_dict("records")
    assert own["why"] == "" and own["peak_of_size"] > 0.0
    assert lost["why"].startswith("no answer on a level") and not lost["believed"]
    assert np.isnan([lost["peak_of_size"], lost["change_rmse_of_peak"], lost["linear_rmse_of_peak"]]).all()
    assert lost["depth_of_size"] == own["peak_of_size"] and lost["force_n"] == 2.0


DEPTHS = np.array([0.01, 0.03, 0.06, 0.1])


@pytest.mark.parametrize("depth", [0.01, 0.02, 0.045, 0.099])
@pytest.mark.parametrize("power", [1.0, 2.0])
def test_a_power_of_the_depth_is_met_exactly(depth, power):
    assert crossing(DEPTHS, (DEPTHS / depth) ** power) == pytest.approx(depth)


def test_what_is_always_or_never_larger():
    assert crossing(DEPTHS, np.full(4, 1.1)) == 0.0
    assert crossing(DEPTHS, np.full(4, 0.9)) == crossing(DEPTHS, np.array([2.0, 2.0, 2.0, 0.5])) == np.inf
    assert crossing(DEPTHS, np.array([2.0, 0.5, 2.0, 3.0])) == pytest.approx(np.sqrt(0.03 * 0.06))  # the last time
    assert 0.03 < crossing(DEPTHS, np.array([0.0, 0.0, 2.0, 3.0])) <= 0.06


def test_every_change_contact_and_mesh(law_table):
    """The cylinder's deepest press under St. Venant-Kirchhoff has no answer; of the liver, the truth is taken away."""
    found = from_depths(law_table)
    assert list(found.columns) == ["body", "changed", "law", "poisson", "contact", "mesh", "from_depth"]
    assert set(found["changed"]) == {"law", "poisson"}
    liver = where(found, body="liver", law="st_venant_kirchhoff").set_index("mesh")["from_depth"]
    # the change is 0.3 of the depth, the meshes' errors 0.05, 0.02 and 0.005
    expected = {"linear": np.inf, "quadratic": 0.02 / 0.3, "finest": 0.005 / 0.3, "own": 0.0}
    assert liver.to_dict() == pytest.approx(expected)  # 0.001 is met before the first depth
    assert len(where(found, body="cylinder", law="st_venant_kirchhoff")) == 4
    law_table.loc[law_table["body"] == "liver", "believed"] = False
    assert set(from_depths(law_table)["body"]) == {"cylinder"}


def test_each_contact_is_pressed_to_each_depth(beam):
    table = growing_presses(beam, 2, [0.02, 0.01], 0.01)
    assert table["contact"].tolist() == np.repeat(sampled_contacts(beam, 2, 1), 2).tolist()
    assert table["peak_of_size"].to_numpy() == pytest.approx([0.01, 0.02] * 2, rel=0.05)
    for sample in samples_in(table):
        contact, force = sample.load.single()
        assert -force @ beam.fine.normals[contact] == pytest.approx(np.linalg.norm(force))


def test_regions_are_changed_with_the_rest_and_left_out(block):
    tumour = Material(30000.0, 0.45, 1100.0)
    region = np.arange(len(block.coarse.tetrahedra)) % 2
    whole = replace(block, regions=Tissue((block.material, tumour), region))
    own, law, poisson, without = variants(whole, ["neo_hookean"], [0.3])
    assert [each.changed for each in (own, law, poisson, without)] == ["nothing", "law", "poisson", "regions"]
    assert without.body.regions is None and without.body.material == block.material
    found = [
        [replace(each, law="", poisson=0.0) for each in part.body.regions.materials] for part in (own, law, poisson)
    ]
    assert found[0] == found[1] == found[2]  # stiffness and density stay
    assert {each.law for each in law.body.regions.materials} == {law.body.tissue(1).law} == {"neo_hookean"}
    assert [each.poisson for each in law.body.regions.materials] == [0.3, 0.45]
    assert {each.poisson for each in poisson.body.regions.materials} == {0.3}
    assert np.array_equal(law.body.tissue(1).region, whole.tissue(1).region)
