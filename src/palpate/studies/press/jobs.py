"""Functions that the rules of workflow/rules/press.smk call; palpate.studies.common_jobs says how."""

from pathlib import Path

from palpate.bodies.body_file import load
from palpate.run.job import steps
from palpate.studies.press.settings import Settings


def export_model(input, output, say, settings: Settings, radius_m: float, seed: int, tolerance: float):
    from palpate.benchmark.model import Case
    from palpate.effects.instrument import Instrument
    from palpate.models.kinds import ContactModes
    from palpate.press.coarse_rival import coarse_answer, save
    from palpate.press.portable.export import export_model
    from palpate.press.portable.touches import Touches

    body = load(input.body)
    save(coarse_answer(body, radius_m), output.coarse)
    case = Case.untrained(body, "press", radius_m, seed, tolerance)
    model = ContactModes(modes=settings.modes, thinned=settings.thinned, target="limit")
    instruments = [Instrument(**dict(each)) for each in settings.instruments]
    touches = Touches(instruments, settings.places) if instruments else None

    def progress(what):
        return steps(say, f"{body.name}: {what}")

    export_model(case, model, settings.contacts, output.model, progress, touches)


def write_press(input, output, contacts: int, samples: int):
    from palpate.press import coarse_rival
    from palpate.press.page.page import held_nodes, press_models, write_pages
    from palpate.press.portable.file import read
    from palpate.studies.press.measure import known_presses, measure, trial_presses

    body, model, coarse = load(input.body), read(input.model), coarse_rival.load(input.coarse)
    known = known_presses(body, input.truths, input.loads, samples)
    trials = trial_presses(body, contacts, 0.5 * model.info["peak_m"])
    models = {"contact_modes": (contacts, model)} | ({"coarse": (0, coarse)} if coarse else {})
    paths = {"contact_modes": Path(input.model), "coarse": Path(input.coarse)}
    table = measure(body.name, models, known, trials, {name: p.stat().st_size / 1e6 for name, p in paths.items()})
    shown = press_models(table, paths, known, model.info)
    write_pages(shown, body.name, held_nodes(body), output.section, output.page)
    return {"table": table}
