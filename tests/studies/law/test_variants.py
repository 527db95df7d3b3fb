"""Bodies with one thing changed."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material, Tissue
from palpate.studies.law.compare_laws import variants


@pytest.fixture
def liver(box, soft):
    mesh = box([2, 1, 1], [0.2, 0.1, 0.1])
    return nest("liver", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), soft)


def changes(found):
    return [(each.changed, each.body.material.law, each.body.material.poisson) for each in found]


def test_what_the_body_has_already_is_no_change(liver):
    found = variants(liver, ["corotational", "neo_hookean"], [0.3, 0.49])
    assert changes(found) == [
        ("nothing", "corotational", 0.3), ("law", "neo_hookean", 0.3), ("poisson", "corotational", 0.49)
    ]  # fmt: skip
    assert found[0].body is liver
    for each in found[1:]:
        assert each.body.levels is liver.levels and each.body.anchors is liver.anchors
        assert (each.body.material.young_pa, each.body.material.density_kg_m3) == (3000.0, 1000.0)


def test_another_body_is_compared_with_its_own_law(liver):
    own = replace(liver, material=replace(liver.material, law="neo_hookean", poisson=0.49))
    found = changes(variants(own, ["corotational", "neo_hookean"], [0.3, 0.49]))
    assert found == [("nothing", "neo_hookean", 0.49), ("law", "corotational", 0.49), ("poisson", "neo_hookean", 0.3)]


def test_regions_are_changed_with_the_rest_and_left_out(liver):
    tumour = Material(30000.0, 0.45, 1100.0)
    region = np.arange(len(liver.coarse.tetrahedra)) % 2
    whole = replace(liver, regions=Tissue((liver.material, tumour), region))
    own, law, poisson, without = variants(whole, ["neo_hookean"], [0.3])
    assert [each.changed for each in (own, law, poisson, without)] == ["nothing", "law", "poisson", "regions"]
    assert without.body.regions is None and without.body.material == liver.material
    found = [
        [replace(each, law="", poisson=0.0) for each in part.body.regions.materials] for part in (own, law, poisson)
    ]
    assert found[0] == found[1] == found[2]  # stiffness and density stay
    assert {each.law for each in law.body.regions.materials} == {law.body.tissue(1).law} == {"neo_hookean"}
    assert [each.poisson for each in law.body.regions.materials] == [0.3, 0.45]
    assert {each.poisson for each in poisson.body.regions.materials} == {0.3}
    assert np.array_equal(law.body.tissue(1).region, whole.tissue(1).region)
