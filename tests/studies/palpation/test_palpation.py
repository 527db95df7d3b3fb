"""Depths of presses are work over force, a region of the same stiffness is not felt, and limits are interpolated."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from fixtures.bodies import SPOT

from palpate.bodies.contacts import contacts_near_regions
from palpate.bodies.material import Tissue
from palpate.bodies.refinement import finer
from palpate.bodies.settings import Box, Plane
from palpate.effects.patch_load import nodal_load
from palpate.errors import InputError
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.palpation import palpation
from palpate.studies.palpation.palpation import Slab, ball_in_slab, least_contrasts, palpate, palpation_limits
from palpate.studies.palpation.settings import Settings, check

SLAB = Slab(sizes_m=[0.08, 0.08, 0.05], young_pa=3000.0, poisson=0.3)


@pytest.fixture(scope="module")
def lump():
    shape = Box(sizes_m=[0.1, 0.1, 0.06], divisions=[8, 8, 5], young_pa=3000, poisson=0.3)
    held = shape.but(anchors=Plane(axis="z", side="min", depth_m=1e-6))
    sphere = {"center_m": [0.05, 0.05, 0.04], "radius_m": 0.015}
    return held.but(regions={"stone": {"sphere": sphere, "young_pa": 30000}}).make("lump")


@pytest.fixture(scope="module")
def felt(lump):
    return palpate(lump, Settings(radius_m=0.015, places=3, pressures_of_young=[0.1, 0.05]))


def test_a_stone_is_felt_above_and_less_beside(felt):
    assert list(felt.columns) == palpation.PALPATION.columns
    by_place = felt.groupby("cover_m")["stiffer"].max().sort_index().to_numpy()
    assert by_place[0] > 0.1 > by_place[-1] >= 0.0 and (np.diff(by_place) < 0).all()
    assert np.array_equal(felt["felt"].to_numpy(dtype=bool), felt["stiffer"] >= palpation.FELT)
    assert (felt.groupby("contact")["depth_m"].diff().dropna() > 0).all()


def test_the_nearest_place_is_above_the_stone(lump, felt):
    nearest = lump.coarse.nodes[felt.sort_values("cover_m")["contact"].iloc[0]]
    assert nearest[2] == pytest.approx(0.06) and np.abs(nearest[:2] - 0.05).max() < 0.02


def test_the_cover_is_what_lies_above_the_region(lump):
    """Elements are 12 mm high and the ball ends 5 mm below the top, so that their nodes end one element below it."""
    covers = contacts_near_regions(lump, 3)[1]
    stiff = lump.fine.nodes[np.unique(lump.fine.tetrahedra[lump.tissue(-1).region > 0])]
    assert covers[0] == pytest.approx(0.06 - stiff[:, 2].max()) == pytest.approx(0.012)
    touching = replace(lump, regions=Tissue(lump.regions.materials, np.ones_like(lump.regions.region)))
    assert np.abs(contacts_near_regions(touching, 3)[1]).max() < 1e-12


def test_depth_times_force_is_twice_the_energy_of_a_small_press(lump, felt):
    """The depth is conjugate to the force, so in the limit of small forces ½ F d is the elastic energy."""
    row, body = felt.iloc[0], finer(lump)
    problem, contact, force = Equilibrium(body, 0, order=2), int(row["contact"]), 1e-3 * row["force_n"]
    load = nodal_load(body, 0, contact, -force * body.fine.normals[contact], 0.015, order=2)
    x = problem.solve(load, 1e-9).x
    elastic = problem.energy(x) + float(np.vdot(load, x - problem.mesh.nodes))
    small = np.vdot(load, x - problem.mesh.nodes) / force
    assert 0.5 * force * small == pytest.approx(elastic, rel=1e-3)
    assert row["depth_m"] / row["force_n"] == pytest.approx(small / force, rel=0.15)


def test_a_region_of_the_same_stiffness_is_not_felt_and_none_is_refused(lump):
    same = replace(lump, regions=Tissue((lump.material,) * 2, lump.regions.region))
    asked = Settings(radius_m=0.015, places=2, pressures_of_young=[0.1])
    assert palpate(same, asked)["stiffer"].abs().max() < 1e-9
    with pytest.raises(InputError, match=r"^bodies\.lump has no regions, so there is nothing to feel; give it some\.$"):
        palpate(replace(lump, regions=None), asked)


@pytest.mark.slow
def test_deeper_balls_are_felt_less_and_stiffer_ones_more():
    table = palpation_limits(Settings(covers_m=[0.006, 0.014], contrasts=[1.0, 10.0, 1e4]), slab=SLAB)
    assert list(table.columns) == palpation.PALPATION_LIMITS.columns
    stiffer = table.pivot_table(index="cover_m", columns="contrast", values="stiffer").to_numpy()
    assert np.abs(stiffer[:, 0]).max() < 1e-6
    assert (np.diff(stiffer, axis=1) > 0).all() and (np.diff(stiffer[:, 1:], axis=0) < 0).all()
    products = table.groupby("contrast")["products"].max()
    assert products[1e4] < 3 * products[1.0]


def test_the_ball_has_its_volume_and_its_place():
    body = ball_in_slab(SLAB, 0.01, 0.006, 0.012, 5.0)
    inside = body.tissue(0).region == 1
    volumes, middles = body.coarse.volumes[inside], body.coarse.nodes[body.coarse.tetrahedra[inside]].mean(axis=1)
    assert volumes.sum() == pytest.approx(4 / 3 * np.pi * 1e-6, rel=0.1)
    assert volumes @ middles / volumes.sum() == pytest.approx([0.04, 0.04, 0.034], abs=1e-4)
    assert body.coarse.volumes.sum() == pytest.approx(np.prod(SLAB.sizes_m))
    assert set(body.tissue(1).young_pa) == {3000.0, 15000.0}
    said = r"^palpation: a ball of radius 0\.01 m, 0\.04 m deep, is not inside the slab of"
    with pytest.raises(InputError, match=said):
        ball_in_slab(SLAB, 0.01, 0.04, 0.012, 5.0)


def test_least_contrasts_interpolate_in_the_logarithm():
    rows = {0.01: [0.1, 0.2, 0.3], 0.02: [0.05, 0.1, 0.12], 0.03: [0.3, 0.4, 0.5]}
    table = pd.DataFrame(rows | {"contrast": (2, 8, 32)}).melt("contrast", var_name="cover_m", value_name="stiffer")
    found = least_contrasts(table.assign(threshold=0.15))
    assert found[0.01] == pytest.approx(4.0) and found[0.02] == np.inf and found[0.03] == pytest.approx(np.sqrt(2.0))


@pytest.mark.parametrize(
    ("regions", "named", "said"),
    [
        (SPOT, ["liver"], r"\.bodies names liver, which has no regions; name lump"),
        (SPOT, ["lumb"], r"\.bodies names lumb, which is not there; did"),
        (None, None, " is there and no body has regions; give one some, or remove palpation"),
    ],
)
def test_settings_name_bodies_with_regions(regions, named, said):
    bodies = {"liver": SimpleNamespace(regions=None), "lump": SimpleNamespace(regions=regions)}
    with pytest.raises(InputError, match=rf"^config\.yaml: palpation{said}"):
        check(SimpleNamespace(bodies=bodies, palpation=Settings(bodies=named)), Path("config.yaml"))
