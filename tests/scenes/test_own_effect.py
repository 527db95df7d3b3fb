"""What is wrong with an effect of the user's own is said before it runs, with its file."""

import numpy as np
import pytest

import palpate as pp
from palpate.bodies.body import nest
from palpate.bodies.particles import particles_of
from palpate.bodies.simple_shapes import sheet
from palpate.effects import bending, body_springs, gravity, linear_elements, springs, triangles, volume_preservation
from palpate.effects.settings import BodySprings, Gravity, Springs, Volume
from palpate.errors import InputError
from palpate.scenes import own_effect
from palpate.scenes.own_effect import disagreement
from palpate.scenes.settings import Scene

CLASS = "import numpy as np\nclass E:\n"
MAKE = "\ndef make(particles, settings, elastic):\n    return E()\n"


@pytest.fixture
def made(tmp_path, slab):
    """Make an effect of the text of a user's file."""

    def make(text: str, **settings) -> object:
        file = tmp_path / "mine.py"
        file.write_text(text)
        own = {"own": {"mine": str(file)}, "own_settings": {"mine": settings}}
        scene = Scene(body="slab", step_s=0.1, duration_s=0.1, **own)
        return own_effect.make("mine", scene, particles_of(slab, 0, surface=False), None)

    return make


def test_a_good_one_is_made(made):
    effect = made(CLASS + "    def add_force(self, x, v, force):\n        force += 1.0" + MAKE)
    force = np.zeros((4, 3))
    effect.add_force(force, force, force)
    assert (force == 1.0).all()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = ", "cannot be imported"),
        ("x = 1", "no function make"),
        ("def make(p): pass", "does not work"),
        ("def make(p, s, e): pass", "has none of"),
        (CLASS + "    def energy(self, x):\n        return 0.0" + MAKE, "has energy and no add_force"),
        (CLASS + "    fixed = [45]" + MAKE, "fixed names nodes other than 0 to 44"),
        (CLASS + "    def add_force(self, x, v, force):\n        x += 1" + MAKE, "changes the positions"),
        (CLASS + "    def add_force(self, x, v, force):\n        force += np.nan" + MAKE, "not finite"),
    ],
)
def test_a_bad_one_is_refused_by_name(made, text, said):
    with pytest.raises(InputError, match=said) as caught:
        made(text)
    assert "mine.py" in str(caught.value)


TIES = """
import numpy as np

class Ties:
    def __init__(self, nodes, stiffness):
        self.couples = np.arange(len(nodes))[:, None]
        self._rest, self._k = nodes, stiffness

    def energy(self, x):
        return 0.25 * self._k * float(np.sum((x - self._rest) ** 4)) {energy}

    def add_force(self, x, v, force):
        force -= {force} * self._k * (x - self._rest) ** 3

    def add_stiffness(self, x, definite, slots, values):
        d = 3.0 * self._k * (x - self._rest) ** 2
        values[slots[:, 0, 0]] += {stiffness} * d[:, :, None] * np.eye(3)

def make(particles, settings, elastic):
    return Ties(particles.nodes, settings.get("k", 5.0))
"""


RIGHT = {"energy": "", "force": "1.0", "stiffness": "1.0"}
FORBIDDEN = "+ (np.inf if np.abs(x - self._rest).max() > 0 else 0.0)"


@pytest.mark.parametrize(
    "given",
    [
        {"k": 1e-6},
        {"k": 1e9},
        {"energy": "+ 1e3"},  # a large constant is no disagreement
        {"stiffness": "0.97"},  # an approximation is accepted
        {"energy": FORBIDDEN, "force": "7.0", "stiffness": "7.0"},  # nothing is compared where it is forbidden
    ],
)
def test_one_that_agrees_is_made(made, given):
    assert made(TIES.format(**RIGHT | given), k=given.get("k", 5.0)).energy is not None


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"force": "-1.0"}, "add_force differs by 2 of"),
        ({"force": "1.01"}, r"add_force differs by 0\.00\d+ of"),
        ({"energy": "+ x[0, 0]"}, "add_force differs by 1 of"),
        ({"stiffness": "-1.0"}, "add_stiffness differs by 2 of"),
        ({"stiffness": "0.8"}, r"add_stiffness differs by 0\.2 of"),
    ],
)
def test_one_that_does_not_is_refused_with_its_error(made, wrong, said):
    with pytest.raises(InputError, match=rf"mine\.py: {said}"):
        made(TIES.format(**RIGHT | wrong))


@pytest.mark.parametrize(
    "module", [linear_elements, springs, gravity, volume_preservation, body_springs, triangles, bending]
)
def test_palpates_own_effects_agree(slab, soft, module):
    cloth = nest("cloth", sheet([0.3, 0.2], [4, 3], 0.001), 0, np.array([0]), soft)
    particles = particles_of(cloth if module in (triangles, bending) else slab, 0, surface=False)
    blocks = {gravity: Gravity(acceleration_m_s2=[0, 0, -9.81]), body_springs: BodySprings()}
    blocks |= {springs: Springs(), volume_preservation: Volume()}
    assert disagreement(module.make(particles, blocks.get(module), None), particles) == ""


CUBE = {"sizes_m": (0.1, 0.1, 0.1), "divisions": (1, 1, 1), "young_pa": 20e3, "poisson": 0.3}


class Pull:
    """A uniform acceleration (3,) [m/s²], as a load of one's own."""

    outer = True

    def __init__(self, *acceleration):
        self.acceleration_m_s2 = np.array(acceleration)

    def make(self, particles, elastic):
        self.forces = particles.masses[:, None] * self.acceleration_m_s2
        return self

    def add_force(self, x, v, force):
        force += self.forces


def test_all_effects_of_ones_own_act_whatever_their_classes_are_called():
    called = type("gravity", (Pull,), {})  # as an effect of palpate's
    asked = [pp.Gravity(acceleration_m_s2=(0, 0, -2.0)), called(3.0, 0, 0), called(0, 4.0, 0)]
    motion = pp.simulate(pp.Box(**CUBE), asked, step_s=0.1, duration_s=0.1)
    moved = (motion.positions[-1] - motion.rest).mean(axis=0)
    assert moved == pytest.approx(0.1**2 * np.array([3.0, 4.0, -2.0]), rel=1e-6)  # of one step from rest


@pytest.mark.parametrize("effects", [pp.Gravity(), [pp.Gravity], ["gravity"], [3], [pp.Box(**CUBE)]])
def test_what_is_no_list_of_effects_is_refused(effects):
    with pytest.raises(InputError, match="effect"):
        pp.simulate(pp.Box(**CUBE), effects, step_s=0.1, duration_s=0.1)
