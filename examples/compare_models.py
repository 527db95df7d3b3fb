"""Compare models, one of them one's own, on presses at contacts that none of them has learnt from."""

import sys
from pathlib import Path

import plot
from case_of_a_liver import errors, make_case

from palpate.models.kinds import FEM, DetailCorrection, LinearFEM, WarpedCompliance
from palpate.models.model_registry import model

OWN = model("nearest", {"nearest": Path(__file__).parents[1] / "docs/example_model.py"})
MODELS = {
    "model of one's own: nearest sample, scaled": OWN,
    "coarse FEM": FEM(order=1, level=0),
    "linear fine FEM, precomputed": LinearFEM(),
    "warped Green's functions": WarpedCompliance(),
    "corrected coarse FEM": DetailCorrection(samples=18),
}


def main(picture=None):
    """Return the mean error of each model, RMSE over peak, by its name."""
    case, asked = make_case()
    found = {name: errors(model.prepare(case), asked).mean() for name, model in MODELS.items()}
    if picture:
        plot.dots(picture, "error, RMSE / peak [%]", {name: 100 * error for name, error in found.items()})
    return found


if __name__ == "__main__":
    for name, error in main(*sys.argv[1:]).items():
        print(f"{name}: {100 * error:.1f} % of the peak")
