"""Carry out ``palpate identify``: presses in, and out what they determine: sentences, tables, a picture, settings."""

import os
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pandas as pd

from palpate.bodies.body import Body
from palpate.bodies.make_body import make_body
from palpate.bodies.material import EXPONENTIAL, LAWS, kind_of
from palpate.effects.instrument import SPHERE
from palpate.errors import InputError, NotConverged, describe_unknown, suggest
from palpate.files import write_whole
from palpate.identification.asked import Asked, identify_and_predict, table_rows, thickness_of
from palpate.identification.fit import Options
from palpate.identification.hereditary import shear_series
from palpate.identification.identify import Identified, line_of
from palpate.identification.prediction import COLUMNS, DEPTH, PLACE, SESSION, SPECIMEN, summary
from palpate.identification.presses import DEEPEST_M, PressRecords, check_units, doubts, read_presses
from palpate.identification.progress import Progress
from palpate.identification.relaxation import Relaxation, relaxation_of, without_time
from palpate.identification.sessions import compare_sessions, consistent_parts
from palpate.init.choose import choose
from palpate.init.command import ticking
from palpate.init.recognise import HOLDS, recognise
from palpate.report.identified_picture import draw_identified
from palpate.report.identified_words import assumed, compared, predicted, relaxes, sentences, uncertain
from palpate.report.words import listed, percent
from palpate.run.job import steps
from palpate.run.settings import complete, read_settings
from palpate.studies.measured.pressed import PRESSES

DEEP = 40.0
"""Thickness of a slab in radii of the ball, above which it acts as a half-space."""
CURVES, ENGINES = "curves", "engines"
"""Folders of the results: forces of models, so that a second run has them, and settings."""


def body_of(given: str | None, config: Path | None, scale_m: float | None, hold: str | None) -> Body | None:
    """Return the body of a mesh file, or of that name in the settings ``config``; None if none is given.

    hold : the side that holds a mesh, as ``palpate init`` has it
    InputError for what is no body, and for a hold that is no side.
    """
    if given is None:
        if config or scale_m or hold:
            raise InputError("--config, --scale and --hold are of a body; give --body, too.")
        return None
    if config is not None:
        settings = complete(read_settings(config), config, needs_study=False)
        if given not in settings.bodies:
            known = suggest(given, list(settings.bodies), "choose from")
            raise InputError(f"--body {given} is not in {config}; {known}")
        return make_body(given, settings.bodies[given].seen_from(config.parent))
    if hold not in (None, *HOLDS):
        raise InputError(f"--hold {hold} is no side; choose from {', '.join(HOLDS)}.")
    data = recognise([Path(given)], scale_m=scale_m)
    data.announce()
    with ticking("the body") as say:
        return choose(data.name, data.entry, hold or data.lies or None, say).body


def identify_file(
    presses: Path, request: Asked, folder: Path | None = None, make: Callable[[], Body | None] = lambda: None
) -> str:
    """Fit the presses of a CSV file, write the folder of results, print progress, and return the answer.

    folder : where to; by default one beside the presses that has their name
    make : returns the body, once all else that is asked for can be used
    InputError for presses, a body or an instrument that do not fit each other; then nothing is written.
    """
    if request.instrument.kind != SPHERE:
        raise InputError(f"--instrument {request.instrument.kind}: forces are known for a ball; give sphere:RADIUS.")
    if unknown := [law for law in request.laws if law != EXPONENTIAL and not (kind_of(law) or Path(law).is_file())]:
        raise InputError(f"--law {describe_unknown(unknown, [*LAWS, EXPONENTIAL])}")
    folder = folder or presses.with_name(f"{presses.stem}_identified")
    _refuse(folder)
    ball, size = request.instrument.radius_m, None if request.thickness_m is None else request.thickness_m[1]
    if size is not None and size > DEEPEST_M:
        raise InputError(f"--thickness is {size:g} m, more than of any organ; give metres or a unit (--thickness 8mm).")
    records = read_presses(presses, request.instrument, request.columns or None, size_m=size)
    request = replace(request, body=request.body or make())
    if request.body is not None:
        check_units(records, request.body.coarse.size)
    for line in (*records.found, *_slab(records, request)):
        print("found   ", line, flush=True)
    if request.thickness_m is not None and (thin := request.thickness_m[0]) > DEEP * ball:
        print(f"warning: --thickness of {thin:g} m is {thin / ball:.3g} radii of the ball, as deep tissue", flush=True)
    for doubt in doubts(records):
        print("warning:", doubt, flush=True)
    relaxation = relaxation_of(records)
    if relaxation is not None:
        if unheld := len(records.presses) - relaxation.holds:
            print(f"warning: {unheld} presses were not held, and are left out", flush=True)
        records = without_time(records, relaxation.kernel)
    comparisons = compare_sessions(records)
    answer = list(compared(comparisons))
    parts, options = consistent_parts(records, comparisons), Options(offset_m=request.offset_m)
    ways: Sequence[str] = (PLACE, DEPTH, SESSION)
    fits = [(*part, options, ways) for part in parts]
    if len({press.specimen for press in records.presses}) > 1:
        fits.append(("all", records, replace(options, resamples=0), (SPECIMEN,)))
    rows, predictions, identified_parts = [], [], []
    with ThreadPoolExecutor(os.cpu_count()) as pool, ticking("the presses") as say, warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of scipy's line search, which tries what overflows
        progress = Progress(lambda what, sequence: steps(say, what)(sequence), pool.map)
        try:
            for name, part, chosen, ways in fits:
                fit, predictions_of_part = identify_and_predict(part, request, chosen, ways, folder / CURVES, progress)
                predictions.append(predictions_of_part.assign(part=name))
                if ways == (SPECIMEN,):
                    answer += predicted(predictions_of_part, fit.law)
                    continue
                answer += [f"{name}:"] if len(parts) > 1 else []
                answer += [*uncertain(fit, line_of(fit)), *sentences(fit, predictions_of_part)]
                rows += table_rows(fit, name)
                identified_parts.append((name, fit))
        except NotConverged as failure:
            small = " or, where the ball is small beside the body, --body" if request.body is not None else ""
            raise InputError(f"{presses}: {failure}; leave out presses that touch nothing{small}.") from failure
    if records.force_error == 0.0:
        answer.append(
            "No rows are before contact: the sensor's zero and slope are assumed 0, which these intervals leave out."
        )
    answer += relaxes(relaxation)
    if request.body is None:
        answer.append(assumed(ball, thickness_of(records, request)[0] is None))
    if request.body is not None and request.body.bed is not None:
        answer.append(
            "What the organ lies on is assumed to be as stiff as the organ: tissue of its modulus, in proportion."
        )
    write_results(folder, pd.DataFrame(rows, columns=PRESSES.columns[1:]), pd.concat(predictions), identified_parts)
    if request.body is not None and len(identified_parts) == 1:
        with ticking("the numbers for engines"):
            answer += _exported(identified_parts[0][1], request, relaxation, folder / ENGINES)
    return "\n".join(["", *answer, "", f"wrote    {folder}: {', '.join(sorted(p.name for p in folder.iterdir()))}"])


def _exported(identified: Identified, request: Asked, relaxation: Relaxation | None, folder: Path) -> list[str]:
    """Write the numbers for engines, and return a sentence on how much stiffer or softer the organ acts there."""
    from palpate.identification.export.numbers import Numbers
    from palpate.identification.export.palpate_config import snippet
    from palpate.identification.export.write import engine_level, export

    body, values = request.body, identified.fitted
    assert body is not None
    poisson = values.get("poisson", body.material.poisson)
    law = f"{identified.law}({values['stiffening']:.3g})" if "stiffening" in values else identified.law
    series = shear_series(relaxation.kernel.series, poisson) if relaxation else None
    loading = relaxation.loading_s if relaxation else 0.0
    density, model = body.material.density_kg_m3, identified.model
    young = identified.young_pa.best * (float(series.modulus(loading)) if series else 1.0)
    numbers = Numbers(body.name, young, poisson, density, law, series, loading)
    presses = [identified.records.presses[k] for k in model.data.order]
    if body.bed is not None:
        file = folder / f"{body.name}_palpate.yaml"
        with write_whole(file) as temporary:
            temporary.write_text(snippet(numbers, body.bed.stiffness_n_m3 / body.material.young_pa), encoding="utf-8")
        return [f"Engines have no bed, on which the organ lies here: only settings of palpate are written, to {file}."]
    level, forward = engine_level(body), model.table.forward
    try:
        exported = export(numbers, body, level, request.instrument, presses, forward, values, folder)
    except NotConverged as failure:
        return [f"No settings for engines are written: {failure}."]
    acts = [
        f"{100 * fact['stiffer_by']:+.0f} % in {engine}, so {fact['young_pa']:.4g} Pa there"
        f" (single places ± {percent(fact['scatter_of_places'])})"
        for engine, fact in exported["engines"].items()
    ]
    mesh = f"the mesh for engines, of {exported['nodes']} nodes,"
    return [f"On {mesh} the same organ is stiffer (+) or softer (−) by {listed(acts)}."]


def write_results(
    folder: Path, identified: pd.DataFrame, predictions: pd.DataFrame, parts: Sequence[tuple[str, Identified]]
) -> None:
    """Write the tables and a picture of each part into ``folder``, each whole or not at all."""
    judged = pd.concat(summary(rows).assign(part=name) for name, rows in predictions.groupby("part", sort=False))
    tables = {"identified": identified, "predictions": predictions[["part", *COLUMNS]]}
    for name, table in (tables | {"prediction_summary": judged}).items():
        with write_whole(folder / f"{name}.csv") as temporary:
            table.to_csv(temporary, index=False)
    for name, fit in parts:
        words = re.sub(r"[^\w-]+", "_", name)
        file = "identified.png" if len(parts) == 1 else f"identified_{words}.png"
        with write_whole(folder / file) as temporary:
            draw_identified(fit).savefig(temporary)


def _slab(records: PressRecords, request: Asked) -> Iterator[str]:
    """Yield a sentence on the thickness that a file has; InputError where another is asked for."""
    thicknesses = [press.thickness_m for press in records.presses if press.thickness_m is not None]
    if not thicknesses:
        return
    has = f"{records.source}: thickness_m is {min(thicknesses):g} to {max(thicknesses):g} m"
    if request.body is not None:
        yield f"{has}; it is not used, as --body says how thick the tissue is"
    elif request.thickness_m is None:
        yield f"{has}, of slabs that lie on something rigid; --thickness takes another"
    else:
        low, high = request.thickness_m
        if not low <= min(thicknesses) <= max(thicknesses) <= high:
            raise InputError(f"{has}, and --thickness {low:g} to {high:g} m; correct or leave out one of them.")


def _refuse(folder: Path) -> None:
    """Raise InputError for a folder that cannot be written to, or that holds something else."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is a file; give another folder with --folder.")
    existing = next(place for place in (folder, *folder.absolute().parents) if place.is_dir())
    if not os.access(existing, os.W_OK):
        raise InputError(f"{existing} may not be written to; give another folder with --folder.")
    expected = re.compile(r"identified.*|prediction.*|curves|engines|\..+")
    if folder.is_dir() and (others := [p.name for p in folder.iterdir() if not expected.fullmatch(p.name)]):
        raise InputError(f"{folder} holds {others[0]}, and is kept; give another folder with --folder.")
