"""Score a file of answers: errors as of palpate's own models, the truth's own as a floor, ties, times and failures."""

import io
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from palpate.bodies.material import NAMED
from palpate.errors import InputError
from palpate.exchange.answers import Answers, Setting
from palpate.exchange.asked_body import FURTHER, law_named
from palpate.exchange.folder import DAMAGE, Arrays, Questions, packed
from palpate.exchange.own_mesh import OwnMesh
from palpate.exchange.suspects import oddities, out_of_order
from palpate.files import write_whole

NO_ANSWER = "the engine gave no answer"
WHERE = ["engine", "version", "hardware", "converged"]
OWN_LAW = ["own_law_rmse_of_peak", "own_law_patch_rms_of_peak"]
MESH = ["mesh_rmse_of_peak", "mesh_patch_rms_of_peak"]


@dataclass(frozen=True, eq=False)
class Scored:
    """What was found of a file of answers.

    samples, settings : rows as ``benchmark.measuring`` has them, with the columns WHERE, OWN_LAW and MESH in settings
    warnings : a sentence each
    """

    answers: Answers
    samples: pd.DataFrame
    settings: pd.DataFrame
    warnings: tuple[str, ...]


def looked_through(
    path: Path,
    answers: Answers,
    questions: Questions,
    rows: np.ndarray,
    known: np.ndarray,
    slipped: Callable[[np.ndarray, Setting, np.ndarray], str],
    warned: list[str],
) -> Iterator[tuple[Setting, np.ndarray, OwnMesh | None]]:
    """Yield each setting with what ``at_points`` returns for it, once that is no slip; add to what is warned.

    rows : the questions whose truth is believed; known : the true displacements of all
    slipped : tells which array of answers to the questions (m,) has a slip of the adapter, and which; or ""
    InputError for a slip.
    """
    warned += answers.warnings
    if lost := questions.count - len(rows):
        warned.append(f"{lost} of {questions.count} questions have no truth that is believed; they are left out.")
    for i, setting in enumerate(answers.settings):
        moved, mesh = at_points(setting, questions)
        there = rows[~setting.failed[rows]]
        if told := slipped(moved, setting, there):
            raise InputError(f"{path}: setting_{i}/{told}.")
        warned += odd(f"{path}: setting_{i}/displacement_m", setting, moved[there], known[there], mesh, there)
        yield setting, moved, mesh


def where_of(answers: Answers, setting: Setting) -> dict[str, Any]:
    """Return the columns WHERE."""
    return dict(zip(WHERE, (answers.engine, answers.version, answers.hardware, setting.converged), strict=True))


def at_points(setting: Setting, questions: Questions) -> tuple[np.ndarray, OwnMesh | None]:
    """Return displacements (k, …, p, 3) [m] at the asked points, and the mesh that they come from, if it is its own."""
    if setting.nodes is None or setting.triangles is None:
        return setting.displacement, None
    mesh = OwnMesh(setting.nodes, setting.triangles, questions.points, questions.arrays["asked"]["triangles"])
    return mesh.at_points(setting.displacement), mesh


def odd(
    place: str, setting: Setting, moved: np.ndarray, known: np.ndarray, mesh: OwnMesh | None, there: np.ndarray
) -> list[str]:
    """Return a sentence for each thing that is odd about answers to the questions ``there`` (m,), but may be none.

    moved, known : (m, …, p, 3) [m], answers and truth at the asked points
    InputError for nodes of the engine's own ``mesh`` that are in another order.
    """
    true = known.reshape(-1, *known.shape[-2:])
    if mesh is not None and len(true):
        at = setting.displacement[there][..., mesh.used, :]
        at = at.reshape(-1, *at.shape[-2:])
        if told := out_of_order(at, mesh.at_nodes(true), mesh.triangles):
            raise InputError(f"{place} {told}.")
    return [f"{place} {each}." for each in oddities(moved.reshape(true.shape), true)]


def mean_errors(errors: list[dict[str, float]]) -> tuple[float, float]:
    """Return the means of errors by name over the surface and in the dent; NaN where there are none."""
    if not errors:
        return np.nan, np.nan
    surface, patch = (float(np.mean([each[name] for each in errors])) for name in ("rmse_of_peak", "patch_rms_of_peak"))
    return surface, patch


def own_law_truth(
    path: Path,
    answers: Answers,
    questions: Questions,
    own_law: Callable[[str], Arrays | None] | None,
    warned: list[str],
) -> Arrays | None:
    """Return the truth of the law of ``answers``, None where that is the body's or has none; add to what is warned.

    InputError for a law that palpate does not have, where its truth is asked for.
    """
    law, bodys = answers.law, questions.info["law"]
    if law == bodys:
        return None
    known, others = bool(law_named(law)), ", ".join((*NAMED, *FURTHER))
    if own_law is not None and not known:
        raise InputError(f"{path}: law is {law}, which palpate does not have; name {others}, or leave --own-law out.")
    truth = None if own_law is None else own_law(law)
    if truth is None:
        how = "ask for it with --own-law" if known else f"palpate has no law of that name, but {others}"
        warned.append(f"the law is {law} and that of the body {bodys}: errors have both in them ({how}).")
    return truth


def kept_truth(folder: Path, law: str) -> Path:
    """Return where the truth of ``law`` is kept, beside the folder of questions."""
    return folder.resolve().parent / f"{folder.resolve().name}.truth_{law}.npz"


def truth_beside(questions: Questions, folder: Path, law: str, find: Callable[[str], Arrays]) -> Arrays:
    """Return the truth of ``law`` that is kept beside the questions; ``find`` it where it is not yet, or damaged."""
    path = kept_truth(folder, law)
    with suppress(*DAMAGE), np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as file:
        found = {name: file[name] for name in file.files}
        if str(found.pop("digest", "")) == questions.digest:
            return found
    found = dict(find(law))
    with write_whole(path) as part:
        part.write_bytes(packed(found | {"digest": np.array(questions.digest)}))
    return found


def floor_of(truth: Arrays) -> dict[str, float]:
    """Return the mean own errors of a truth where it is believed, by name; NaN where it never is."""
    names = ("rmse_of_peak", "patch_rms_of_peak", "force_rms_of_peak")
    own = {name: truth[f"own_{name}"] for name in names if f"own_{name}" in truth}
    known = np.isfinite([own[name] for name in names[:2]]).all(axis=0)
    return {name: float(values[known].mean()) if known.any() else np.nan for name, values in own.items()}
