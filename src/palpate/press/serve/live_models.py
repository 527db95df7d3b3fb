"""Choose and prepare the models of a finished run that can answer a press anywhere."""

import json
from collections.abc import Iterable
from contextlib import suppress

import numpy as np
import pandas as pd

from palpate.benchmark.model import Model
from palpate.errors import InputError, NotConverged
from palpate.press.finished_run import FinishedRun
from palpate.press.serve.knife import MOST_NODES, KnifeModel, read_cuts
from palpate.press.serve.pressed_model import Asked, Bounds, Found, PressedModel, read_presses
from palpate.report.page_assets import base64_of

OFFERED = ("fast_fem", "fem_p2", "fem_p1")
"""Models that need neither samples nor prepared contacts, best first."""
KNIVES = {"cut_elements": False, "cut_linear": True}
"""Models that follow a knife, and whether strains are small; they need no measured row, as only they are cut."""
SOON_S = 0.1
"""Time of an answer that a finger follows without waiting."""
BEYOND = 5.0
"""Factor over the hardest and the deepest press of the run up to which presses are answered."""


class LiveModels:
    """The models that answer presses of one scene; each is prepared when it is asked for first.

    names : of the models; case : what they are prepared from
    """

    def __init__(self, run: FinishedRun, scene: str, wanted: str | None = None):
        rows = run.rows(scene)
        names = [wanted] if wanted else [name for name in OFFERED if name in set(rows["model"])]
        if not names:
            raise InputError(f"{run.results}: none of {', '.join(OFFERED)} was measured; choose a model with --model.")
        self.case, self._run = run.case(scene), run
        self.rows = {name: best_row(rows[rows["model"] == name], self._settings(name)) for name in names}
        self.bounds = Bounds(len(self.case.database.triangles), BEYOND * self.hardest, BEYOND * self.peak)
        self._made: dict[str, PressedModel] = {}
        self._knives: dict[str, KnifeModel] = {}

    @property
    def names(self) -> list[str]:
        """The names of the models, the first of which answers first."""
        return list(self.rows)

    @property
    def knives(self) -> list[str]:
        """The names of the models that follow a knife; none on a bed, which holds both lips, or of a very fine mesh."""
        body = self.case.body
        return [] if body.bed is not None or len(body.coarse.nodes) > MOST_NODES else list(KNIVES)

    @property
    def peak(self) -> float:
        """The largest displacement [m] of the presses that the run has made."""
        return float(self.case.database.peaks.max())

    @property
    def hardest(self) -> float:
        """The largest force [N] of these."""
        return float(np.linalg.norm(self.case.database.force, axis=1).max())

    def prepare(self, name: str) -> PressedModel:
        """Return a model, prepared at its first use; InputError or NotConverged if that cannot be done."""
        if name not in self._made:
            model = self._settings(name)[self.rows[name]["setting"]]
            self._made[name] = PressedModel(self.case, model.prepare(self.case))
        return self._made[name]

    def knife(self, name: str) -> KnifeModel:
        """Return a model that follows a knife, prepared at its first use; InputError if that cannot be done."""
        if name not in self._knives:
            self._knives[name] = KnifeModel(self.case, KNIVES[name])
            with suppress(InputError, NotConverged):  # its code is compiled before it is timed
                self._knives[name].respond([self._slight_press()])
        return self._knives[name]

    def warm_up(self, name: str) -> None:
        """Prepare a model and let it answer a press to a depth once, so that the code for that is compiled."""
        model = self.prepare(name)
        with suppress(InputError, NotConverged):  # a page that asks for it is told
            model.respond([self._slight_press()])

    def _slight_press(self) -> Asked:
        """Return a press of the first sample's place to a hundredth of the largest displacement."""
        row = np.searchsorted(self.case.body.fine.surface, self.case.database.contact[0])
        triangle = int(np.argmax((self.case.database.triangles == row).any(axis=1)))
        return Asked(triangle, np.full(3, 1 / 3), None, np.array([0.0, 0.0, 0.01 * self.peak]))

    def answer(self, name: str, body: bytes) -> bytes:
        """Return the JSON of an answer to the JSON of presses; InputError or NotConverged if there is none.

        Trap: models keep what they reuse between answers, so one is asked after the other.
        """
        if read_cuts(body):
            raise InputError("this model was prepared for the whole body and follows no cut; choose another.")
        return _answer_json(self.prepare(name).respond(read_presses(body, self.bounds)))

    def answer_cut(self, name: str, body: bytes) -> bytes:
        """Return the JSON of an answer of a model that is cut, to a request that names cuts and presses."""
        model = self.knife(name)
        surface, *_ = model.follow(read_cuts(body))
        bounds = self.bounds._replace(triangles=len(surface.triangles))
        return _answer_json(model.respond(read_presses(body, bounds)))

    def cut(self, name: str, body: bytes) -> bytes:
        """Return the JSON of the surface after the cuts that the JSON ``body`` names; InputError for a faulty cut.

        nodes, triangles, held : as in a page's head; skin : number of nodes of the skin, which come before the lips';
            rims : edges of the skin along cuts
        ms, drawn_ms : milliseconds until the model could answer, and of finding the surface after that
        """
        surface, held, ready_ms, drawn_ms = self.knife(name).follow(read_cuts(body))
        content = {"nodes": base64_of(surface.nodes.astype("<f4").tobytes()), "skin": surface.skin_nodes}
        content |= {"rims": surface.rims.tolist()}
        content |= {"triangles": base64_of(surface.triangles.astype("<u4").tobytes())}
        content |= {"held": base64_of(held.astype(np.uint8).tobytes()), "ms": ready_ms, "drawn_ms": drawn_ms}
        return json.dumps(content, allow_nan=False).encode()

    def _settings(self, name: str) -> dict[str, Model]:
        """Return a model's settings that answer anywhere, by their text in tables; InputError if there are none.

        Those that start from the frame before are left out, as there is none.
        """
        all_settings = self._run.models(name, self.case)
        anywhere = [each for each in all_settings if not (each.needs_contacts or getattr(each, "start", "") == "frame")]
        if not anywhere:
            raise InputError(f"--model {name} answers at prepared contacts only; choose from {', '.join(OFFERED)}.")
        return {each.text: each for each in anywhere}


def best_row(rows: pd.DataFrame, known: Iterable[str]) -> pd.Series:
    """Return the ``known`` settings' row of least validation error that answers soon, or the fastest; InputError."""
    rows = rows[rows["setting"].isin(list(known))]
    if rows.empty:
        raise InputError("accuracy_vs_time.csv has other settings than the configuration; type make.")
    soon = rows[(rows["online_p95_s"] <= SOON_S) & rows["validation_rmse_of_peak"].notna()]
    if soon.empty:
        return rows.sort_values("online_p95_s").iloc[0]
    return soon.sort_values("validation_rmse_of_peak", kind="stable").iloc[0]


def _answer_json(answer: Found) -> bytes:
    packed = base64_of(answer.displacement.astype("<f4").tobytes())
    content = {"displacement": packed, "forces": answer.forces.tolist(), "error": answer.error}
    return json.dumps(content | {"doubt": answer.doubt, "ms": answer.milliseconds}, allow_nan=False).encode()
