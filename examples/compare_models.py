"""Compare models, one of them one's own, on presses at contacts that none of them has learnt from."""

import sys
from pathlib import Path

import plot
from press_a_liver import LIVER

import palpate as pp

sys.path.append(str(Path(__file__).parents[1] / "docs"))
from example_model import Nearest

MODELS = {
    "model of one's own: nearest sample, scaled": Nearest(samples=15),
    "coarse FEM": pp.FEM(order=1, level=0),
    "linear fine FEM, precomputed": pp.LinearFEM(),
    "warped Green's functions": pp.WarpedCompliance(),
    "corrected coarse FEM": pp.DetailCorrection(coarse="converged"),
}


def main(picture=None):
    """Return the mean error of each model, RMSE over peak, by its name."""
    case = pp.make_case(LIVER.make(), radius_m=0.02, contacts=25, seed=1)
    found = pp.compare(case, MODELS.values()).summary
    errors = dict(zip(MODELS, found["error [%]"], strict=True))
    if picture:
        plot.dots(picture, "error, RMSE / peak [%]", errors)
    return errors


if __name__ == "__main__":
    for name, error in main(*sys.argv[1:]).items():
        print(f"{name}: {error:.2g} % of the peak")
