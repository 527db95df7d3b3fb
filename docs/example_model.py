"""A model of your own: the nearest training sample's answer, scaled to the force that is asked for."""

import numpy as np

from palpate.models.memory import held_mb


def settings(case):
    """Settings from cheap to expensive: how many of the training samples are kept."""
    return [{"samples": max(1, case.n_training * part // 5)} for part in (1, 2, 3, 4, 5)]


def prepare(case, setting):
    """Work offline: it is timed, and what simulating the training samples took is added."""
    return Nearest(case.first(setting["samples"]).use_training())


class Nearest:
    """Answers with the sample whose contact lies nearest at rest, times the ratio of the forces."""

    def __init__(self, training):
        self.places, self.contact = training.coarse_nodes, training.contact
        self.force, self.fine = training.force, training.fine
        self.memory_mb = held_mb(self)

    def respond(self, contact, force):
        """Displacement (n_surface, 3) [m] under ``force`` (3,) [N] at coarse node ``contact``; online, and timed."""
        away = np.linalg.norm(self.places[self.contact] - self.places[contact], axis=1)
        i = int(away.argmin())
        return self.fine[i] * np.linalg.norm(force) / np.linalg.norm(self.force[i])
