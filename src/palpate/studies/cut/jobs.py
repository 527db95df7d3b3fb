"""Functions that the rules of workflow/rules/cut.smk call; palpate.studies.common_jobs says how."""

from palpate.run.job import steps
from palpate.stores import store, stored
from palpate.studies.cut.settings import Pull

FRONT_OF_WIDTH = 0.5
"""Longest edges at the front of a cut over its half width, on the meshes that are halved; elsewhere at the cut 1."""


def find_cut_truth(input, output, wildcards, entry: Pull):
    from palpate.benchmark.cut_truth import truth_of_cut
    from palpate.bodies.body_file import load
    from palpate.studies.cut.measure import asked, truth_row

    case = asked(load(input.body), entry)
    cut = case.cuts[0]
    found = truth_of_cut(case.body, cut, case.hooks, cut.narrow_m, FRONT_OF_WIDTH * cut.narrow_m, case.places)
    store(found, output.truth)
    return {"table": truth_row(wildcards.scene, case, found)}


def measure_cut(input, wildcards, say, entry: Pull, repeats: int, budget_s: float):
    from palpate.benchmark.cut_truth import CutTruth
    from palpate.bodies.body_file import load
    from palpate.studies.cut.measure import asked, measure_cut

    case, progress = asked(load(input.body), entry), steps(say, f"{wildcards.scene}: setting")
    tables = measure_cut(wildcards.scene, case, stored(CutTruth, input.truth), repeats, budget_s, progress)
    return dict(zip(("cut", "opening"), tables, strict=True))
