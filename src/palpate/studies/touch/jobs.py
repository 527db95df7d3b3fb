"""Functions that the rules of workflow/rules/touch.smk call; palpate.studies.common_jobs says how."""

import pandas as pd

from palpate.run.job import free_mb, steps, write_table
from palpate.stores import store, stored


def simulate_touch_truth(input, output, params, wildcards, say):
    from palpate.benchmark.touch import choose_touches, given_touches, touches_of
    from palpate.benchmark.touch_mesh import bearing
    from palpate.benchmark.touch_truth import Asked, truth_of_touches
    from palpate.bodies.body_file import load
    from palpate.effects.instrument import Instrument

    body, instrument, asked = load(input.body), Instrument(**params.instrument), Asked(**params.truth)
    if params.at:
        table = given_touches(body, instrument, params.at)
    else:
        chosen = params.samples, tuple(params.depth_of_radius), params.seed
        table = choose_touches(body, instrument, *chosen, bearing(body, asked.along_radius))
    write_table(table, output.touches)
    touches = touches_of(instrument, pd.read_csv(output.touches))
    progress = steps(say, f"{wildcards.body}, {wildcards.tool}: truth of touch")
    store(truth_of_touches(body, touches, progress, asked, say, free_mb()), output.truth)


def measure_touch_models(input, params, wildcards, say):
    from palpate.benchmark.touch import TouchCase, touches_of
    from palpate.benchmark.touch_measure import load_model, measure_touches
    from palpate.benchmark.touch_truth import TouchTruth
    from palpate.bodies.body_file import load
    from palpate.effects.instrument import Instrument

    instrument = Instrument(**params.instrument)
    touches = touches_of(instrument, pd.read_csv(input.touches))
    deepest = max([params.deepest_of_radius * instrument.radius_m, *(touch.depth_m for touch in touches)])
    case = TouchCase(load(input.body), instrument, deepest, params.seed, params.settings)
    asked = touches, stored(TouchTruth, input.truth), params.repeats, params.budget_s
    progress = steps(say, f"{wildcards.body}, {wildcards.tool}, {wildcards.model}: setting")
    tables = measure_touches(case, wildcards.model, load_model(params.place, params.keywords), *asked, progress)
    return dict(zip(("samples", "settings"), tables, strict=True))


def tabulate_touch(input, params):
    from palpate.benchmark.touch import TouchCase, touches_of
    from palpate.benchmark.touch_measure import truth_rows
    from palpate.benchmark.touch_truth import TouchTruth
    from palpate.bodies.body_file import load
    from palpate.effects.instrument import Instrument
    from palpate.studies.touch.tables import Known, touch_forces_table, touch_table, touch_truth_table

    known, samples, settings = [], [], []
    files = zip(input.bodies, input.touches, input.truths, params.instruments, strict=True)
    for body, chosen, solved, entry in files:
        instrument, touches, truth = Instrument(**entry), pd.read_csv(chosen), stored(TouchTruth, solved)
        case = TouchCase(load(body), instrument, touches["depth_m"].max(), 0)
        places = case.body.fine.nodes[touches["node"]]
        own, row = truth_rows(case, touches_of(instrument, touches), truth)
        labels = row[["scene", "body", "instrument"]].iloc[0].to_dict() | entry
        known.append(Known({name: labels[name] for name in labels if name != "kind"}, touches, truth, places))
        samples.append(own)
        settings.append(row)
    samples += map(pd.read_csv, input.samples)
    settings += map(pd.read_csv, input.settings)
    tables = {"truth": touch_truth_table(known), "forces": touch_forces_table(known)}
    return tables | {"touch": touch_table(_joined(settings), _joined(samples))}


def _joined(tables):
    """Join tables, of which some may have no rows."""
    return pd.concat([table for table in tables if len(table)] or tables[:1], ignore_index=True)
