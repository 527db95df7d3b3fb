"""Exported files say what was identified, in the engine's units, for the mesh that the engine has."""

import json
import runpy
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest
import yaml

from palpate.bodies.make_body import make_body
from palpate.bodies.material import Material, Series
from palpate.bodies.mesh_file import load_shape
from palpate.bodies.settings import Box
from palpate.effects.instrument import Instrument
from palpate.effects.linear_elements import LinearElements
from palpate.identification.export.numbers import FREQUENCY_HZ, Numbers
from palpate.identification.export.palpate_config import snippet
from palpate.identification.export.pressed_mesh import filling_points, mesh_force, pressed
from palpate.identification.export.write import engine_level, export
from palpate.identification.on_body import touch_of
from palpate.identification.presses import Press
from palpate.scenes.settings import Prony

BALL = Instrument("sphere", 0.02)
NUMBERS = Numbers("slab", 2500.0, 0.4, 1050.0, "neo_hookean")
RELAXING = replace(NUMBERS, relaxation=Series([0.3, 0.2], [0.5, 5.0]), loading_s=1.0)
DEEP_M = 6e-3


class Slab:
    """Some organ, for Young's modulus 1 Pa."""

    parameters, relative_error, deepest_m = (), 0.0, 0.02

    def forces(self, press, depth_m, values):
        return 0.25 * depth_m**1.5


@pytest.fixture(scope="module")
def body():
    entry = Box(
        sizes_m=[0.08, 0.08, 0.04], divisions=[8, 8, 4], refinements=0, young_pa=1.0, poisson=0.3, density_kg_m3=1.0,
        anchors={"plane": {"axis": "z", "side": "min", "depth_m": 0.001}},
    )  # fmt: skip
    return make_body("slab", entry)


@pytest.fixture(scope="module")
def presses():
    depth_m, way = np.linspace(0.0, DEEP_M, 5), np.array([0.0, 0.0, -1.0])
    places = [np.array([x, y, 0.04]) for x, y in ((0.04, 0.04), (0.034, 0.05), (0.045, 0.03))]
    return [Press(str(i), "", "", "", at, way, None, depth_m, np.zeros(5)) for i, at in enumerate(places)]


@pytest.fixture(scope="module")
def touches(body, presses):
    return [touch_of(body, BALL, press, DEEP_M) for press in presses]


@pytest.fixture(scope="module")
def folder(body, presses, tmp_path_factory):
    place = tmp_path_factory.mktemp("exported")
    export(NUMBERS, body, 0, BALL, presses, Slab(), {}, place)
    return place


def test_the_mesh_for_engines_is_the_finest_that_is_not_too_large():
    entry = Box(
        sizes_m=[0.1, 0.1, 0.1], divisions=[3, 3, 3], refinements=3, young_pa=1.0, poisson=0.3, density_kg_m3=1.0,
        anchors={"plane": {"axis": "z", "side": "min", "depth_m": 0.001}},
    )  # fmt: skip
    block = make_body("block", entry)
    nodes = [len(mesh.nodes) for mesh in block.levels]
    assert nodes[engine_level(block)] == 13**3 and nodes[-1] == 25**3


def test_the_mean_over_places_is_made_good(folder):
    facts = json.loads((folder / "exported.json").read_text())
    for said in facts["engines"].values():
        over = np.array(said["force_over_organ"])
        assert np.log(over * said["young_pa"] / facts["young_pa"]).mean() == pytest.approx(0.0, abs=1e-9)
        assert said["stiffer_by"] == pytest.approx(np.exp(np.log(over).mean()) - 1.0)


def test_mujoco_has_the_numbers(folder, body):
    scene = ElementTree.parse(folder / "slab.xml").getroot()
    facts = json.loads((folder / "exported.json").read_text())
    elastic, flex = scene.find(".//elasticity").attrib, scene.find(".//flexcomp").attrib
    assert float(elastic["young"]) == pytest.approx(facts["engines"]["mujoco"]["young_pa"])
    assert float(elastic["poisson"]) == 0.4
    assert float(flex["mass"]) == pytest.approx(1050.0 * 0.08 * 0.08 * 0.04)
    assert [int(node) for node in scene.find(".//pin").attrib["id"].split()] == body.anchors[0].tolist()
    points, _, tetrahedra = load_shape(folder / flex["file"])
    assert np.allclose(points, body.fine.nodes) and np.array_equal(np.sort(tetrahedra), np.sort(body.fine.tetrahedra))


@pytest.mark.parametrize("engine", ["sofa", "newton"])
def test_scripts_are_python_with_the_numbers(folder, body, engine):
    told = runpy.run_path(str(folder / f"slab_{engine}.py"))
    said = json.loads((folder / "exported.json").read_text())["engines"][engine]
    assert told["YOUNG_PA"] == pytest.approx(said["young_pa"]) and told["POISSON"] == 0.4
    assert told["DENSITY_KG_M3"] == 1050.0 and "acts" in told["__doc__"]
    if engine == "newton":
        material, arrays = Material(told["YOUNG_PA"], 0.4, 1050.0), np.load(folder / "slab.npz")
        assert (told["MU_PA"], told["LAMBDA_PA"]) == pytest.approx((material.shear_pa, material.lame_pa))
        assert np.array_equal(arrays["nodes_m"], body.fine.nodes) and np.array_equal(arrays["held"], body.anchors[0])


class Recorder:
    """Stands for a node of SOFA, and keeps what is added."""

    def __init__(self):
        self.objects, self.children = {}, []

    def addObject(self, kind, **data):
        self.objects[kind] = data

    def addChild(self, name):
        self.children.append(Recorder())
        return self.children[-1]


def test_the_scene_of_sofa_holds_and_damps(folder, body):
    told, root = runpy.run_path(str(folder / "slab_sofa.py")), Recorder()
    told["createScene"](root)
    organ = root.children[0].objects
    assert organ["TetrahedronFEMForceField"]["youngModulus"] == told["YOUNG_PA"]
    assert organ["FixedProjectiveConstraint"]["indices"] == body.anchors[0].tolist()
    assert organ["MeshMatrixMass"]["massDensity"] == 1050.0
    assert organ["EulerImplicitSolver"]["rayleighStiffness"] == NUMBERS.damping_s


def test_palpate_reads_its_own():
    told = yaml.safe_load(snippet(RELAXING))
    assert told["bodies"]["slab"]["law"] == "neo_hookean"
    held = 1.0 + (0.3 * np.exp(-2.0) + 0.2 * np.exp(-0.2)) / 0.5
    assert told["bodies"]["slab"]["young_pa"] == pytest.approx(2500.0 / held, rel=1e-5)
    assert Prony.model_validate(told["scenes"]["slab_relaxes"]["prony"]).shares == [0.3, 0.2]
    assert "scenes" not in yaml.safe_load(snippet(NUMBERS))


def test_damping_loses_what_relaxation_loses():
    swing = 2.0j * np.pi * FREQUENCY_HZ
    modulus = 1.0 + sum(share / 0.5 * swing * t / (1.0 + swing * t) for share, t in ((0.3, 0.5), (0.2, 5.0)))
    damped = 1.0 + swing * RELAXING.damping_s
    assert damped.imag / damped.real == pytest.approx(modulus.imag / modulus.real)


def test_points_fill_the_triangles_under_the_ball(body):
    points = filling_points(body.fine, 1.0, np.array([0.04, 0.04, 0.06]), 0.02)
    at = points.interpolation @ body.fine.nodes
    assert np.allclose(at[:, 2], 0.04)
    corners = body.fine.nodes[np.abs(body.fine.nodes - (0.04, 0.04, 0.04)).max(axis=1) < 0.021]
    corners = corners[corners[:, 2] > 0.039]
    assert np.linalg.norm(at[:, None] - corners, axis=2).min(axis=0).max() < 1e-12
    grown = points.stretch(2.0 * body.fine.nodes)
    assert grown == pytest.approx(np.full(len(at), 4.0))


def test_no_node_is_left_inside_the_ball(body, touches):
    """The force is not less than that of a point load which moves the node under the ball as deep."""
    found = mesh_force(body, 0, touches[0], touches[0].poses[body])
    nodes = LinearElements(body.fine, body.tissue(0))
    assert found > 0.5 * DEEP_M * np.median(nodes.resistance()[body.fine.surface])


def test_locked_elements_are_not_pressed(body, touches):
    assert pressed(body, 0, "corotational", 0.49, touches[:1], np.ones(1)).poisson == 0.45
