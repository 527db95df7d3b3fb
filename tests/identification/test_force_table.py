"""A table of forces is what it was made from, between its values too."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.pressed_layer import Layer

from palpate.identification.force_table import TOLERANCE, natural, tabulate
from palpate.identification.forward import Parameter

RANGES = (
    Parameter("poisson", 0.3, 0.49),
    Parameter("thickness_m", 0.005, 0.04),
    Parameter("stiffening", 0.0, 3.0),
)


def test_forces_between_the_values_of_a_table_are_those_of_the_model():
    layer = Layer(0.004, RANGES)
    table = tabulate(layer, range(2), 0.003)
    rng = np.random.default_rng(1)
    assert table.error < TOLERANCE
    assert (table.table == 0).all()  # all presses are alike
    depths = np.exp(table.start + table.step * np.arange(table.log_forces.shape[-1]))
    for place in rng.uniform(-1, 1, (20, 3)):
        logs, slopes = table.at(place)
        asked = layer.forces(0, depths, table.values(place))
        assert np.exp(logs[0]) == pytest.approx(asked, rel=2 * TOLERANCE)
        near = layer.forces(0, depths * np.exp(1e-4), table.values(place))
        assert slopes[0] == pytest.approx(np.log(near / asked) / 1e-4, abs=0.01)


def test_presses_with_forces_of_their_own_have_their_own_tables():
    class Two(Layer):
        def forces(self, press, depth_m, values):
            return (1 + (press % 2)) * super().forces(press, depth_m, values)

    table = tabulate(Two(0.004), range(5), 0.003)
    assert table.table.tolist() == [0, 1, 0, 1, 0]
    logs, _ = table.at(np.zeros(1))
    assert logs[1] - logs[0] == pytest.approx(np.log(2.0))


@pytest.mark.parametrize(("parameter", "middle"), list(zip(RANGES, (0.395, 0.0002**0.5, 1.0), strict=True)))
def test_a_range_is_divided_by_value_by_ratio_or_by_stiffness(parameter, middle):
    """The middle of thicknesses is their geometric mean, that of stiffenings b the one of 1 + b."""
    assert [natural(parameter, place) for place in (-1.0, 0.0, 1.0)] == pytest.approx(
        [parameter.low, middle, parameter.high]
    )


def test_a_parameter_without_a_range_has_its_value():
    known = Parameter("poisson", 0.4, 0.4)
    table = tabulate(replace(Layer(0.004), parameters=(known,)), [0], 0.003)
    assert table.values(np.zeros(0)) == {"poisson": 0.4}
