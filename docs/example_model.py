"""A model of your own: the response of the nearest training sample, scaled by the ratio of the forces."""

import numpy as np

from palpate.benchmark.model import held_mb

REDUCES = "p2"  # its answers are made of training responses


def settings(case):
    """Return settings from cheap to expensive: how many of the training samples are kept."""
    return [{"samples": max(1, case.n_training * part // 5)} for part in (1, 2, 3, 4, 5)]


def prepare(case, setting):
    """Prepare offline: this is timed, and what simulating the training samples took is added."""
    return Nearest(case.first(setting["samples"]).use_training())


class Nearest:
    """Answer with the sample whose contact is nearest at rest, times the ratio of the forces."""

    def __init__(self, training):
        self.places, self.contact = training.coarse_nodes, training.contact
        self.force, self.fine = training.force, training.fine
        self.memory_mb = held_mb(self)

    def respond(self, load):
        """Return the displacement (n_surface, 3) [m] under ``load``; timed."""
        contact, force = load.single()
        away = np.linalg.norm(self.places[self.contact] - self.places[contact], axis=1)
        i = int(away.argmin())
        return self.fine[i] * np.linalg.norm(force) / np.linalg.norm(self.force[i])
