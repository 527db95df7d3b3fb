"""What is wrong with an effect of the user's own is said before it runs, with its file."""

import numpy as np
import pytest

from palpate.bodies.material import Material
from palpate.bodies.particles import Particles
from palpate.errors import InputError
from palpate.scenes import own_effect

NODES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
PARTICLES = Particles("tet", NODES, np.ones(4), np.array([0]), FACES, np.array([[0, 1, 2, 3]]), Material(1e3, 0.4, 1e3))
CLASS = "import numpy as np\nclass E:\n"
MAKE = "\ndef make(particles, settings, elastic):\n    return E()\n"


def made(tmp_path, text: str) -> object:
    file = tmp_path / "mine.py"
    file.write_text(text)
    return own_effect.make(file, own_effect.load("mine", file, "scenes.s"), PARTICLES, {}, None)


def test_a_good_one_is_made(tmp_path):
    effect = made(tmp_path, CLASS + "    def add_force(self, x, v, force):\n        force += 1.0" + MAKE)
    force = np.zeros((4, 3))
    effect.add_force(NODES, NODES, force)
    assert (force == 1.0).all()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = ", "cannot be imported"),
        ("import sys\nsys.exit(3)", "cannot be imported"),
        ("x = 1", "no function make"),
        ("def make(p): pass", "does not work"),
        ("def make(p, settings, e): return settings['speed']", "does not work"),
        ("def make(p, s, e): pass", "has none of"),
        (CLASS + "    pass" + MAKE, "has none of"),
        (CLASS + "    def energy(self, x):\n        return 0.0" + MAKE, "has energy and no add_force"),
        (CLASS + "    fixed = [4]" + MAKE, "fixed names nodes other than 0 to 3"),
        (CLASS + "    couples = [[0.5]]\n    fixed = [0]" + MAKE, "couples names nodes"),
        (CLASS + "    def add_force(self, x, v, force):\n        return x" + MAKE, "returns a value"),
        (CLASS + "    def add_force(self, x, v, force):\n        x += 1" + MAKE, "changes the positions"),
        (CLASS + "    def add_force(self, x, v, force):\n        force += np.nan" + MAKE, "not finite"),
        (CLASS + "    def add_force(self, x, v, force):\n        force += np.ones(7)" + MAKE, "does not work"),
    ],
)
def test_a_bad_one_is_refused_by_name(tmp_path, text, said):
    with pytest.raises(InputError, match=said) as caught:
        made(tmp_path, text)
    assert "mine.py" in str(caught.value)
