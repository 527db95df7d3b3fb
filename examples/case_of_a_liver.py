"""Make what models learn from and are judged by: a liver with simulated presses. The other examples use it."""

import numpy as np
from press_a_liver import LIVER

from palpate.benchmark.load import Load
from palpate.benchmark.model import Case
from palpate.benchmark.presses import choose_loads
from palpate.benchmark.settings import FitOptions, Widths
from palpate.benchmark.split import split
from palpate.benchmark.static_responses import assemble, press
from palpate.bodies.make_body import make_body
from palpate.solvers.compliance import compute_compliance

RADIUS_M = 0.02


def make_case(train=18, test=6):
    """Return a case with ``train`` samples, and ``test`` samples at contacts that no training sample presses."""
    body = make_body("liver", LIVER)
    linear = compute_compliance(body, RADIUS_M)  # responses to unit forces, without samples
    loads = choose_loads(body, linear, [0.5, 1.0, 1.5], 0.05, RADIUS_M, train + test, seed=1)
    fine, coarse = press(body, 1, loads, 1e-8), press(body, 0, loads, 1e-8)
    samples = assemble(body, loads, fine, coarse, "")
    known, asked = split(samples.contact, train, test, "contacts", seed=1)
    options = FitOptions(
        neighbours=10, sigma_relative=Widths(min=0.1, max=10.0, count=5), folds=3, split="contacts", seed=1
    )
    return Case(body, "medium", RADIUS_M, samples.take(known), linear, options, 1e-8), samples.take(asked)


def errors(solver, asked):
    """Return RMSE over peak of each sample that is ``asked``."""
    answers = np.array([solver.respond(Load.at(c, f)) for c, f in zip(asked.contact, asked.force, strict=True)])
    return np.sqrt(((answers - asked.fine) ** 2).sum(axis=2).mean(axis=1)) / asked.peaks
