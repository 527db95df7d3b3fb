"""Forces that are not those of the energy are found by differences, with how wrong they are; palpate's own are not."""

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.particles import particles_of
from palpate.bodies.sheet import sheet
from palpate.effects import bending, body_springs, gravity, linear_elements, springs, triangles, volume_force
from palpate.errors import InputError
from palpate.scenes import own_effect
from palpate.scenes.own_effect import disagreement

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


@pytest.fixture
def made(tmp_path, slab):
    """Make an effect of the user's, with what is wrong about it."""

    def make(energy="", force="1.0", stiffness="1.0", **settings):
        file = tmp_path / "ties.py"
        file.write_text(TIES.format(energy=energy, force=force, stiffness=stiffness))
        particles = particles_of(slab, 0, surface=False)
        return own_effect.make(file, own_effect.load("ties", file, "scenes.s"), particles, settings, None)

    return make


@pytest.mark.parametrize("k", [1e-6, 5.0, 1e9])
def test_one_that_agrees_is_made(made, k):
    assert made(k=k).energy is not None


def test_a_large_constant_energy_is_no_disagreement(made):
    made(energy="+ 1e3")


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (
            {"force": "-1.0"},
            r"ties\.py: add_force differs by 2 of its size from minus the gradient of energy, by",
        ),
        ({"force": "2.0"}, r"ties\.py: add_force differs by 0\.5 of its size from minus the gradient of energy"),
        ({"force": "1.01"}, r"ties\.py: add_force differs by 0\.00\d+ of its size"),
        ({"energy": "+ x[0, 0]"}, r"ties\.py: add_force differs by 1 of its size"),
        (
            {"stiffness": "-1.0"},
            r"ties\.py: add_stiffness differs by 2 of its size from minus the gradient of add_",
        ),
        ({"stiffness": "0.8"}, r"ties\.py: add_stiffness differs by 0\.2 of its size"),
        ({"stiffness": "0.0"}, r"ties\.py: add_stiffness differs by 1 of its size"),
    ],
)
def test_one_that_does_not_is_refused_with_its_error(made, wrong, said):
    with pytest.raises(InputError, match=said) as caught:
        made(**wrong)
    assert str(caught.value).endswith("differences at a displaced state; correct it, see docs/add-an-effect.md.")


def test_an_approximate_stiffness_is_accepted(made):
    made(stiffness="0.97")


def test_an_energy_that_is_forbidden_near_rest_is_not_compared(made):
    made(energy="+ (np.inf if np.abs(x - self._rest).max() > 0 else 0.0)", force="7.0", stiffness="7.0")


@pytest.mark.parametrize("module", [linear_elements, springs, gravity, volume_force, body_springs])
def test_palpates_own_effects_of_solids_agree(slab, module):
    particles = particles_of(slab, 0, surface=False)
    settings = {gravity: {"acceleration_m_s2": [0, 0, -9.81]}, body_springs: {"damping_ratio": 0.5}}
    assert disagreement(module.make(particles, settings.get(module, {}), None), particles) == ""


@pytest.mark.parametrize("module", [triangles, bending])
def test_palpates_own_effects_of_sheets_agree(soft, module):
    cloth = particles_of(nest("cloth", sheet([0.3, 0.2], [4, 3], 0.001), 0, np.array([0]), soft), 0, surface=False)
    assert disagreement(module.make(cloth, {}, None), cloth) == ""
