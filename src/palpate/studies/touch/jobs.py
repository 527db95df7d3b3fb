"""Functions that the rules of workflow/rules/touch.smk call; palpate.studies.common_jobs says how."""

import pandas as pd

from palpate.benchmark.settings import Given, TouchTruthSettings
from palpate.benchmark.settings import Instrument as ToolSettings
from palpate.run.job import free_mb, steps, write_table
from palpate.stores import store, stored
from palpate.studies.touch.settings import Families


def simulate_touch_truth(
    input, output, wildcards, say, instrument: ToolSettings, truth: TouchTruthSettings, at: list[Given],
    samples: int, depth_of_radius: tuple[float, float], seed: int,
):  # fmt: skip
    from palpate.benchmark.touch import choose_touches, given_touches, touches_of
    from palpate.benchmark.touch_mesh import check_by_coarse_elements
    from palpate.benchmark.touch_truth import truth_of_touches
    from palpate.bodies.body_file import load
    from palpate.effects.instrument import Instrument

    body, tool = load(input.body), Instrument(**dict(instrument))
    if at:
        table = given_touches(body, tool, at)
    else:
        chosen = samples, depth_of_radius, seed
        table = choose_touches(body, tool, *chosen, check_by_coarse_elements(body, truth.along_radius))
    write_table(table, output.touches)
    touches = touches_of(tool, pd.read_csv(output.touches))
    progress = steps(say, f"{wildcards.body}, {wildcards.tool}: truth of touch")
    store(truth_of_touches(body, touches, progress, truth, say, free_mb()), output.truth)


BUDGET_S = 0.1
"""Time [s] for which each setting is asked again, beyond once for each touch."""


def measure_touch_models(
    input, wildcards, say, instrument: ToolSettings, deepest_of_radius: float, place: str, keywords: dict,
    settings: Families, repeats: int, seed: int,
):  # fmt: skip
    from palpate.benchmark.measuring import measure, tables
    from palpate.benchmark.touch import TouchCase, touches_of
    from palpate.benchmark.touch_measure import Touches, load_model, touch_settings
    from palpate.benchmark.touch_truth import TouchTruth
    from palpate.bodies.body_file import load
    from palpate.effects.instrument import Instrument
    from palpate.models.load_model import own_settings

    tool = Instrument(**dict(instrument))
    touches = touches_of(tool, pd.read_csv(input.touches))
    deepest = max([deepest_of_radius * tool.radius_m, *(touch.depth_m for touch in touches)])
    case = TouchCase(load(input.body), tool, deepest, seed, settings)
    name, progress = wildcards.model, steps(say, f"{wildcards.body}, {wildcards.tool}, {wildcards.model}: setting")
    if place.endswith(".py"):
        tried = own_settings(name, place, "touch", case.body, tool.name, tool.radius_m, seed, progress)
    else:
        tried = touch_settings(case, name, load_model(place, keywords), progress)
    kind = Touches(case, touches, stored(TouchTruth, input.truth), place)
    found = tables(kind, *measure(kind, tried, repeats, BUDGET_S))
    return dict(zip(("samples", "settings"), found, strict=True))


def tabulate_touch(input, instruments: list[ToolSettings]):
    from palpate.benchmark.touch import TouchCase, touches_of
    from palpate.benchmark.touch_measure import truth_rows
    from palpate.benchmark.touch_truth import TouchTruth
    from palpate.bodies.body_file import load
    from palpate.effects.instrument import Instrument
    from palpate.studies.touch.tables import Known, touch_forces_table, touch_table, touch_truth_table

    known, samples, settings = [], [], []
    files = zip(input.bodies, input.touches, input.truths, instruments, strict=True)
    for body, chosen, solved, tool in files:
        instrument, touches, truth = Instrument(**dict(tool)), pd.read_csv(chosen), stored(TouchTruth, solved)
        case = TouchCase(load(body), instrument, touches["depth_m"].max(), 0)
        places = case.body.fine.nodes[touches["node"]]
        own, row = truth_rows(case, touches_of(instrument, touches), truth)
        labels = row[["scene", "body", "instrument"]].iloc[0].to_dict() | dict(tool)
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
