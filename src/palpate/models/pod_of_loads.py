"""Answer from the load alone: POD modes of the samples, with coefficients by a Gaussian process or a network."""

import numpy as np

from palpate.benchmark.load import Load
from palpate.benchmark.model import Case, Setting
from palpate.bodies.contacts import contacts_of, row_of
from palpate.errors import NotConverged
from palpate.models.coarse_answers import fitting_to
from palpate.models.enrichment.pod_of_loads import PodOfLoads, gaussian_process, network
from palpate.models.memory import held_mb

REDUCES, LAW = "p2", "the body's"
FAR = 1.5
"""Largest norm of an answer over that of the farthest sample; beyond it the model says that it does not know."""


def settings(case: Case, learner: str) -> list[Setting]:
    """List numbers of modes, of which there are at most as many as training samples, and of a network hidden units."""
    grid = case.grid["pod_of_loads"]
    modes = sorted({min(count, case.n_training) for count in grid["modes"]})
    if learner == "gaussian":
        return [{"modes": count} for count in modes]
    return [{"modes": modes[len(modes) // 2], "hidden": count} for count in grid["hidden"]]


def prepare(case: Case, setting: Setting, learner: str) -> "Learnt":
    """Fit the learner to all training samples."""
    return Learnt(case, setting)


class Learnt:
    """Modes, and what gives their coefficients."""

    def __init__(self, case: Case, setting: Setting):
        fitting = fitting_to(case)
        learn = network(setting["hidden"]) if "hidden" in setting else gaussian_process
        self._contacts = contacts_of(case.body)
        self._pod = PodOfLoads(fitting.db, fitting.training, setting["modes"], learn, fitting.options)
        self._reach = float(np.linalg.norm(fitting.training.fine, axis=(1, 2)).max())
        self.memory_mb = held_mb(self)

    def respond(self, load: Load) -> np.ndarray:
        """Return the displacement (n_surface, 3) [m] under ``load``; errors as ``Solver``.

        NotConverged beyond the guard FAR.
        """
        contact, force = load.single()
        row_of(self._contacts, contact)
        moved = self._pod.respond(contact, force)
        far = float(np.linalg.norm(moved)) / self._reach
        if not far <= FAR:
            raise NotConverged(f"this goes {far:.1f} times as far as any sample, beyond what is learnt", [far])
        return moved
