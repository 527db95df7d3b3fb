"""Choose presses that grow over depth, at a few contacts of a body."""

from collections.abc import Callable, Sequence

import pandas as pd

from palpate.benchmark.presses import choose_presses
from palpate.bodies.body import Body
from palpate.studies.palpation.palpation import choose_places


def growing_presses(
    body: Body, contacts: int, depths: Sequence[float], radius_m: float, progress: Callable = iter
) -> pd.DataFrame:
    """Choose a press along the inward normal for each of ``depths``, at each of ``contacts`` contacts.

    A body with regions is also pressed above them, at the contact nearest to one; ``contacts`` may then be 0.
    depths : largest displacements, as shares of the body's size; radius_m : of the disc that is pressed [m]
    Returns the table of ``choose_presses``. Where the peak pressure that the trade-off allows ends the depth of a
    contact, its deepest press is the one with that pressure. Warns of these, and raises, as ``choose_presses`` does.
    """
    most = max(depths)
    above = [] if body.regions is None else choose_places(body, 1)[0][:1].tolist()
    presses = [{"magnitude": depth / most, "tilt_degrees": 0} for depth in sorted(depths)]
    table = choose_presses(body, contacts, presses, {"peak_of_size": most}, radius_m, 1, progress, above)
    forces = ["contact", "force_x_n", "force_y_n", "force_z_n"]
    return table[~table[forces].round(12).duplicated()].reset_index(drop=True)
