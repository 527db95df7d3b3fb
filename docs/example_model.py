"""A model of your own: the response of the nearest training sample, scaled by the ratio of the forces."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Nearest:
    """Answer with the sample whose contact is nearest at rest; its fields are its setting, in tables too."""

    samples: int = 18  # of the training samples
    reduces = "p2"  # its answers are made of training responses

    @classmethod
    def tried(cls, case):
        """Return what is tried, from cheap to expensive: shares of the training samples."""
        return [cls(max(1, case.n_training * part // 5)) for part in (1, 2, 3, 4, 5)]

    def prepare(self, case):
        """Prepare offline: this is timed, and what simulating the training samples took is added."""
        return NearestSample(case.first(self.samples).use_training())


class NearestSample:
    """What answers: ``memory_mb`` would say how much it holds if its arrays did not."""

    def __init__(self, training):
        self.places, self.contact = training.coarse_nodes, training.contact
        self.force, self.fine = training.force, training.fine

    def respond(self, load):
        """Return the displacement (n_surface, 3) [m] under ``load``; timed."""
        contact, force = load.single()
        away = np.linalg.norm(self.places[self.contact] - self.places[contact], axis=1)
        i = int(away.argmin())
        return self.fine[i] * np.linalg.norm(force) / np.linalg.norm(self.force[i])
