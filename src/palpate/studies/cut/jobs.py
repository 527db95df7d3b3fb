"""Functions that the rules of workflow/rules/cut.smk call; palpate.studies.common_jobs says how."""

from palpate.run.job import steps
from palpate.stores import store, stored


def find_cut_truth(input, output, params, wildcards):
    from palpate.benchmark.cut_truth import truth_of_cut
    from palpate.bodies.body_file import load
    from palpate.studies.cut.measure import asked, truth_row

    case = asked(load(input.body), params.entry)
    cut = case.cuts[0]
    edges = (params.truth[name] * cut.narrow_m for name in ("edge_of_width", "front_of_width"))
    truth = truth_of_cut(case.body, cut, case.hooks, *edges, case.places)
    store(truth, output.truth)
    return {"table": truth_row(wildcards.scene, case, truth)}


def measure_cut(input, params, wildcards, say):
    from palpate.benchmark.cut_truth import CutTruth
    from palpate.bodies.body_file import load
    from palpate.studies.cut.measure import asked, measure_cut

    case, progress = asked(load(input.body), params.entry), steps(say, f"{wildcards.scene}: setting")
    limits = params.repeats, params.budget_s
    tables = measure_cut(wildcards.scene, case, stored(CutTruth, input.truth), params.settings, *limits, progress)
    return dict(zip(("cut", "opening"), tables, strict=True))
