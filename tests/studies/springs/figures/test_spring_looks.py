"""Every method for spring parameters has a look, and an unknown one is refused."""

import pytest

from palpate.errors import InputError
from palpate.report import spring_looks


def test_an_unknown_way_has_no_colour():
    with pytest.raises(InputError, match="method annealing has no colour"):
        spring_looks.look("annealing")
