"""Carry out ``palpate press``: open a finished run's body in a browser, until Ctrl-C."""

import shlex
import signal
import sys
import threading
import webbrowser
from collections.abc import Mapping
from functools import partial
from math import isclose
from pathlib import Path
from typing import Any

import pandas as pd

from palpate.benchmark.model import Case
from palpate.errors import InputError
from palpate.press.coarse_rival import coarse_answer, packed
from palpate.press.finished_run import FinishedRun
from palpate.press.page.page import PressModel, held_nodes, model_in_page, press_document
from palpate.press.portable.file import read
from palpate.press.serve.knife import cut_level
from palpate.press.serve.live_models import LiveModels
from palpate.press.serve.server import Answer, PressServer
from palpate.report.model_looks import label
from palpate.report.words import percent, seconds, spaced

CONTACT_MODES = "contact_modes"
CUT_TITLES = {"cut_elements": "elements for the knife", "cut_linear": "linear elements for the knife"}
CUT_ABOUT = {
    "cut_elements": "Linear elements, doubled where the knife went, with the body's law.",
    "cut_linear": "Linear elements, doubled where the knife went, with one factor for all presses.",
}


def press(
    config: Path | None, results: Path | None, scene: str | None, model: str | None, port: int, browser: bool
) -> str:
    """Serve the page of a scene until Ctrl-C or SIGTERM, and return the last words; InputError if there is no such run.

    config, results : of the run; either is found beside the other; config.yaml and results/ here if both are None
    scene, model : what is pressed and what answers; the run's first scene and its models that answer anywhere if None
    """
    run = find_run(config, results)
    signals = (signal.SIGINT, signal.SIGTERM)  # a shell lets what it starts in the background ignore the first
    earlier_handlers = [signal.signal(number, signal.default_int_handler) for number in signals]
    try:
        chosen = scene or run.scenes[0]
        with PressServer(port) as server:  # before what takes a minute, as the port may be in use
            live = LiveModels(run, chosen, model)
            print(f"preparing {chosen} ...", file=sys.stderr, flush=True)
            from threadpoolctl import threadpool_limits

            with threadpool_limits(limits=1):  # products are small, and threads would wait for each other
                live.warm_up(live.names[0])
            server.offer(_page(live, run, chosen, model), answers(live))
            print(f"{chosen} can be pressed at {server.address}\nfrom this machine only; Ctrl-C ends it", flush=True)
            if browser:  # one in a terminal would not come back before it is closed
                threading.Thread(target=webbrowser.open, args=[server.address], daemon=True).start()
            server.serve_forever()
    except KeyboardInterrupt:  # whenever it comes, it is how one leaves
        return "closed"
    finally:
        for number, handler in zip(signals, earlier_handlers, strict=True):
            signal.signal(number, handler)
    return "closed"


def answers(live: LiveModels) -> Mapping[str, Answer]:
    """Return the functions that answer a page's requests, by their addresses below the page's."""
    functions = {f"answer/{name}": partial(live.answer, name) for name in live.names}
    functions |= {f"answer/{name}": partial(live.answer_cut, name) for name in live.knives}
    return functions | {f"cut/{name}": partial(live.cut, name) for name in live.knives}


def find_run(config: Path | None, results: Path | None) -> FinishedRun:
    """Return the run of settings and results, of which one or both may be left out; InputError if it has no results."""
    if results and not results.is_dir():
        raise InputError(f"{results}: there is no such folder; give the results of a run with --results.")
    if config is None:
        folder = results.resolve().parent if results else Path()
        config = next((folder / name for name in ("config.yaml", "try.yaml") if (folder / name).is_file()), None)
        if config is None:
            raise InputError(f"{folder} has no config.yaml; give the settings of the run with --config.")
    elif not config.is_file():
        raise InputError(f"{config}: there is no such file; give the settings of the run.")
    run = FinishedRun(config, results or config.parent / "results")
    if not (run.results / "tables/accuracy_vs_time.csv").is_file():
        make = f"make CONFIG={shlex.quote(str(config))}"
        raise InputError(f"{run.results} holds no finished run with the study tradeoff; type {make}.")
    return run


def _page(live: LiveModels, run: FinishedRun, scene: str, only: str | None) -> str:
    """Return the page of a scene, with all its models or ``only`` one: in a file, or asked from this server."""
    case, body = live.case, live.case.body
    # in the words of a portable file's header
    info: dict[str, Any] = {"body": body.name, "regime": case.regime, "radius_m": case.radius_m}
    info |= {"size_m": body.fine.size, "young_pa": body.material.young_pa}
    info |= {"peak_m": live.peak, "hardest_n": live.hardest}
    if models := [] if only else _in_file(run.folder(scene).parent / "press", case):
        info |= models[0].info  # or the same colour would be another displacement in the view beside
    served = partial(PressModel, nodes=case.meshes.nodes_fine_surface, triangles=case.meshes.triangles, info=info)
    for name, row in live.rows.items():
        about = f"Error {percent(row['rmse_of_peak'])} of the peak; {seconds(row['online_p95_s'])} for a given force."
        models.append(served(name, label(name, row["setting"]), url=f"answer/{name}", advice=about))
    for name in live.knives:
        about = f"{CUT_ABOUT[name]} {1e3 * cut_level(body)[1]:.0f} mm long, they open where a cut severs most of one."
        models.append(served(name, CUT_TITLES[name], url=f"answer/{name}", knife=f"cut/{name}", advice=about))
    if (coarse := coarse_answer(body, case.radius_m)) is not None:
        models.append(model_in_page("coarse", packed(coarse), info))
    return press_document(models, f"Press it: {spaced(scene)}", held_nodes(body))


def _in_file(folder: Path, case: Case) -> list[PressModel]:
    """Return the portable model that the study press has written to ``folder``, if its discs have the case's radius."""
    path, measured = folder / f"{CONTACT_MODES}.palpate", folder / "press.csv"
    if not path.is_file() or not isclose((model := read(path)).radius_m, case.radius_m, rel_tol=1e-6):
        return []
    rows = pd.read_csv(measured).itertuples() if measured.is_file() else ()
    row = next((row for row in rows if row.model == CONTACT_MODES), None)
    return [model_in_page(CONTACT_MODES, path.read_bytes(), model.info, row)]
