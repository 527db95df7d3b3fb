"""Learn what stored responses lack, from the load alone: no mesh is simulated."""

from typing import Protocol

import numpy as np

from palpate.benchmark.database import Database
from palpate.bodies.contacts import row_of
from palpate.models.enrichment.feature_vectors import Ordered
from palpate.models.enrichment.ridge import KernelRidge
from palpate.models.enrichment.rotation_vectors import turn
from palpate.models.enrichment.training_samples import FitOptions, Training, convinces
from palpate.solvers.compliance import Compliance

KINDS = ("response", "force")
"""What describes a load: the linear response of the coarse surface nodes, which says where the force acts too; or the
force along the axes of its contact, as which all contacts are alike."""


class Base(Protocol):
    """The answer that is known without samples."""

    def answer(self, contact: int, force: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """Return the fine surface displacement (n, 3) [m], and rotation vectors (n, 3) of its nodes or None."""

    def superpose(self, presses: list[tuple[int, np.ndarray]]) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] under several forces (3,) [N], each at its contact."""


class LoadResidual:
    """``base`` plus its residual by kernel ridge, in axes that turn with the nodes if the base knows how they turn.

    Linear responses are exact to the first order in the force, so that the residual begins at the second, as its kernel
    does. Cross-validation chooses one of KINDS, and whether any residual is added. With the force along the contact's
    axes the residual stands along them too, its nodes ordered by their distance from the contact (paper 1).
    """

    def __init__(self, db: Database, compliance: Compliance, base: Base):
        self._base, self._contacts = base, compliance.contacts
        self._seen = np.ascontiguousarray(compliance.restricted[:, :, db.coarse_surface])
        self._views = Ordered(db, 1, framed=True)
        self._learnt: KernelRidge | None = None
        self.kind = ""

    def learn(self, training: Training, options: FitOptions) -> "LoadResidual":
        """Fit it to the training samples, whose coarse displacements are not looked at."""
        samples = list(zip(training.contact.tolist(), training.force, strict=True))
        answers = [self._base.answer(*sample) for sample in samples]
        left = np.array([u - answer for u, (answer, _) in zip(training.fine, answers, strict=True)])
        plain = np.sqrt(np.mean(np.sum(left**2, axis=2), axis=1)) / training.peaks
        backward = [e if w is None else turn(-w, e) for e, (_, w) in zip(left, answers, strict=True)]
        tried = {}
        for kind in KINDS:
            described = np.array([self._described(kind, *sample) for sample in samples])
            targets = [self._to_slots(kind, c, e) for (c, _), e in zip(samples, backward, strict=True)]
            tried[kind] = KernelRidge(described, np.array(targets), training, options, power=2)
        best = min(tried, key=lambda kind: tried[kind].score)
        if convinces(tried[best].errors, plain, training.fold):
            self.kind, self._learnt = best, tried[best]
            for contact in self._contacts if best == "force" else ():
                self._views.view(int(contact))  # ordered in advance, so that no query sorts
        return self

    def respond(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m]; InputError for a contact that is not prepared."""
        answer, spins = self._base.answer(contact, force)
        if self._learnt is None:
            return answer
        found = self._learnt.predict(self._described(self.kind, contact, force))
        extra = found if self.kind == "response" else self._views.view(contact).from_slots(found.ravel())
        return answer + (extra if spins is None else turn(spins, extra))

    def _described(self, kind: str, contact: int, force: np.ndarray) -> np.ndarray:
        if kind == "response":
            return np.tensordot(force, self._seen[row_of(self._contacts, contact)], 1).ravel()
        frame = self._views.view(contact).frame
        return force if frame is None else force @ frame

    def _to_slots(self, kind: str, contact: int, residual: np.ndarray) -> np.ndarray:
        return residual.ravel() if kind == "response" else self._views.view(contact).to_slots(residual)
