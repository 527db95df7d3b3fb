"""Presses on a body are those of elements at its place, whatever of its parameters is asked for."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import jv

from palpate.benchmark.touch import Touch
from palpate.benchmark.touch_mesh import TouchedMeshes
from palpate.bodies.make_body import make_body
from palpate.bodies.settings import Box, Plane
from palpate.effects.instrument import Instrument
from palpate.effects.patch_load import Patch
from palpate.errors import InputError
from palpate.identification import on_body
from palpate.identification.forward import Parameter
from palpate.identification.on_body import OrganForward, far_compliance
from palpate.identification.presses import Press

BALL = Instrument("sphere", 0.02)
DEEP_M = 4e-3
SHAPE = Box(
    sizes_m=[0.1, 0.1, 0.04], divisions=[5, 5, 2], refinements=1, young_pa=4000.0, poisson=0.3, density_kg_m3=1000.0,
    anchors={"plane": {"axis": "x", "side": "min", "depth_m": 0.001}},
)  # fmt: skip
"""A plate that is clamped on one side, so that it bends far."""


class Hertz:
    """The linear half-space; a stand-in for the curves of finite strain."""

    relative_error, deepest_m = 0.0, 0.02
    parameters = (Parameter("poisson", 0.3, 0.49),)

    def forces(self, press, depth_m, values):
        return 4.0 / 3.0 * np.sqrt(BALL.radius_m) * np.clip(depth_m, 0.0, None) ** 1.5 / (1.0 - values["poisson"] ** 2)


def press(at=(0.07, 0.05, 0.04), direction=(0.0, 0.0, -1.0), depth_m=DEEP_M, name="p"):
    where = [None if each is None else np.array(each) for each in (at, direction)]
    return Press(name, "", "", "", *where, None, np.linspace(0.0, depth_m, 5), np.zeros(5))


@pytest.fixture(scope="module")
def plate():
    return make_body("plate", SHAPE)


@pytest.fixture(scope="module")
def organ(plate):
    presses = [press(), press(at=(0.05, 0.04, 0.04)), press(name="again")]
    return OrganForward(plate, BALL, presses, Hertz())


def by_elements(poisson, at):
    """The force of quadratic elements that are half as long, and fine at the rim of what is held."""
    body = make_body("plate", SHAPE.but(poisson=poisson, law="neo_hookean"))
    node = int(np.linalg.norm(body.fine.nodes - at, axis=1).argmin())
    touch = Touch(BALL, node, np.array([0.0, 0.0, -1.0]), DEEP_M)
    return TouchedMeshes(body).around(touch, 2, 2).answer(1e-4)[0].force_n / 4000.0


def test_a_half_space_gives_way_as_the_transform_says():
    whole = quad(lambda x: jv(2, x) ** 2 / x**4, 1e-9, 200.0, limit=400)[0]
    assert pytest.approx(64.0 / np.pi * whole, rel=1e-6) == on_body.HALF_SPACE


def test_a_deep_block_gives_way_like_a_half_space():
    held = Plane(axis="z", side="min", depth_m=0.01)
    body = SHAPE.but(sizes_m=[1.0, 1.0, 1.0], divisions=[10, 10, 10], anchors=held).make("block")
    radius = 0.1
    patch = Patch(np.array([0.5, 0.5, 1.0]), np.array([0.0, 0.0, 1.0]), radius)
    half = on_body.HALF_SPACE * (1.0 - 0.3**2) / radius
    # what a bonded base a metre below and free sides take and add is of the order of the radius over the depth
    assert abs(far_compliance(body, 0, [patch])[0]) < 0.1 * half


@pytest.mark.slow
@pytest.mark.parametrize("poisson", [0.3, 0.45])
def test_it_has_the_force_of_finer_elements(organ, poisson):
    found = organ.forces(0, np.array([DEEP_M]), {"poisson": poisson})[0]
    assert found == pytest.approx(by_elements(poisson, (0.07, 0.05, 0.04)), rel=0.03)


@pytest.mark.slow
def test_a_plate_that_bends_is_softer_where_it_is_farther_from_its_clamp(organ):
    depth, values = np.array([DEEP_M]), {"poisson": 0.3}
    assert organ.forces(0, depth, values) < 0.9 * organ.forces(1, depth, values)
    assert organ.forces(1, depth, values) < Hertz().forces(0, depth, values)


@pytest.mark.parametrize(
    ("wrong", "ball", "said"),
    [
        ({"at": (0.07, 0.05, 0.2)}, BALL, "off"),
        ({"at": (0.5, 0.5, 0.04)}, BALL, "off"),
        ({"at": (0.0, 0.05, 0.04)}, BALL, "held"),
        ({"at": None}, BALL, "place"),
        ({}, Instrument("sphere", 0.06), "larger"),
        ({}, Instrument("punch", 0.01), "ball"),
        ({"depth_m": 0.045}, BALL, "deeper"),
    ],
)
def test_presses_that_are_none_of_this_body_are_refused(plate, wrong, ball, said):
    local = Hertz()
    local.deepest_m = 1.0
    with pytest.raises(InputError, match=said):
        OrganForward(plate, ball, [press(**wrong)], local)


@pytest.mark.slow
def test_deeper_than_the_curves_is_refused(organ):
    with pytest.raises(InputError, match="depth"):
        organ.forces(0, np.array([0.019]), {"poisson": 0.4})
