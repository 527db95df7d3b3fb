"""Compare models, one of them one's own, on presses at contacts that none of them has learnt from."""

import sys
from pathlib import Path

import plot
from case_of_a_liver import errors, make_case

from palpate.models.model_registry import model

OWN = {"nearest": str(Path(__file__).parents[1] / "docs/example_model.py")}
NAMES = {
    "nearest": "model of one's own: nearest sample, scaled",
    "fem_p1": "coarse FEM",
    "linear_fem": "linear fine FEM, precomputed",
    "warped_compliance": "warped Green's functions",
    "detail_correction": "corrected coarse FEM",
}
ALL = {"samples": 18}
SETTINGS = {"nearest": ALL, "warped_compliance": {"samples": 0}, "detail_correction": {"coarse": "converged"} | ALL}
SETTINGS |= {"fem_p1": {"level": 0, "start": "rest", "tolerance": 1e-8}}


def main(picture=None):
    """Return the mean error of each model, RMSE over peak, by its name."""
    case, asked = make_case()
    found = {}
    for name in NAMES:
        solver = model(name, OWN).offline(case).online(SETTINGS.get(name, {}))
        found[name] = errors(solver, asked).mean()
    if picture:
        plot.dots(picture, "error, RMSE / peak [%]", {NAMES[name]: 100 * error for name, error in found.items()})
    return found


if __name__ == "__main__":
    for name, error in main(*sys.argv[1:]).items():
        print(f"{NAMES[name]}: {100 * error:.1f} % of the peak")
