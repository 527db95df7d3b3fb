"""Answer with stored linear responses that are turned with their own rotations, and a kernel ridge on what they lack.

Without samples it is the published method: ``warped_response`` has it.
"""

import numpy as np

from palpate.benchmark.database import Database
from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Solver, held_mb
from palpate.bodies.contacts import row_of
from palpate.models import kinds
from palpate.models.coarse_answers import training_of
from palpate.models.depths import Discs
from palpate.models.enrichment.features import Ordered
from palpate.models.enrichment.ridge import KernelRidge
from palpate.models.enrichment.training_samples import Training, convinces
from palpate.models.limit import at_limit
from palpate.models.near_buckling import NearBuckling
from palpate.models.warped_response import LinearFem, WarpedResponse, turn
from palpate.solvers.compliance import Compliance

KINDS = ("response", "force")
"""What describes a load: the linear response of the coarse surface nodes, which says where the force acts too; or the
force along the axes of its contact, as which all contacts are alike."""


Base = LinearFem | WarpedResponse
"""The answer that is known without samples."""


class LoadResidual:
    """``base`` plus its residual by kernel ridge, in axes that turn with the nodes if the base knows their rotations.

    Linear responses are exact to first order in the force: so the residual begins at second order, as its kernel does.
    Cross-validation chooses one of KINDS, and whether any residual is added. Described by the force along the contact's
    axes, the residual is along them too, with nodes ordered by their distance from the contact (paper 1).
    """

    def __init__(self, db: Database, compliance: Compliance, base: Base):
        self._base, self._contacts = base, compliance.contacts
        seen = compliance.restricted[:, :, db.coarse_surface]
        self._seen = np.ascontiguousarray(seen).reshape(len(seen), 3, -1)
        self._views = Ordered(db, 1, framed=True)
        self._learnt: KernelRidge | None = None
        self.kind = ""

    def learn(self, training: Training) -> "LoadResidual":
        """Fit the residual to training samples; their coarse displacements are not used."""
        db = training.db
        samples = list(zip(db.contact.tolist(), db.force, strict=True))
        answers = [self._base.answer(*sample) for sample in samples]
        residuals = np.array([u - answer for u, (answer, _) in zip(db.fine, answers, strict=True)])
        base_errors = np.sqrt(np.mean(np.sum(residuals**2, axis=2), axis=1)) / db.peaks
        unturned = [e if w is None else turn(-w, e) for e, (_, w) in zip(residuals, answers, strict=True)]
        candidates = {}
        for kind in KINDS:
            described = np.array([self._described(kind, *sample) for sample in samples])
            targets = [e.ravel() for e in unturned]
            if kind == "force":
                targets = [self._views.view(c).to_slots(e) for (c, _), e in zip(samples, unturned, strict=True)]
            candidates[kind] = KernelRidge(described, np.array(targets), training, power=2)
        best_kind = min(candidates, key=lambda kind: candidates[kind].score)
        if convinces(candidates[best_kind].errors, base_errors, training.fold):
            self.kind, self._learnt = best_kind, candidates[best_kind]
            for contact in self._contacts if best_kind == "force" else ():
                self._views.view(int(contact))  # ordered in advance, so that no query sorts
        return self

    def respond(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m]; InputError for a contact that is not prepared."""
        answer, spins = self._base.answer(contact, force)
        if self._learnt is None:
            return answer
        predicted = self._learnt.predict(self._described(self.kind, contact, force))
        residual = predicted if self.kind == "response" else self._views.view(contact).from_slots(predicted.ravel())
        return answer + (residual if spins is None else turn(spins, residual))

    def _described(self, kind: str, contact: int, force: np.ndarray) -> np.ndarray:
        if kind == "response":
            return force @ self._seen[row_of(self._contacts, contact)]
        frame = self._views.view(contact).frame
        return force if frame is None else force @ frame


class Stored(Solver):
    """The answer of stored responses ``base``, with a residual that is learnt from ``samples``: 0 none, None all."""

    def __init__(self, case: Case, base: Base, samples: int | None):
        self._base, self._residual, self._discs, self._buckling = base, None, Discs(case), NearBuckling(case)
        if samples != 0:
            training = training_of(case.first(samples))
            self._residual = LoadResidual(case.meshes, case.use_compliance(), base).learn(training)

    @property
    def memory_mb(self) -> float:
        return held_mb([self._base, self._residual, self._buckling])

    def respond(self, load: Load) -> np.ndarray | Answer:
        """Answer as ``Solver`` does; Doubted near the load under which the body buckles.

        Without a residual, responses to several presses add up, and discs may be pushed to a depth; the residual is
        learnt from single presses, and answers these only.
        """
        if self._residual is not None:
            return self._buckling.checked(load, self._residual.respond(*load.single()))
        forces, to_depth = load.parted()
        answer = self._base.at_depth(load, self._discs) if to_depth else self._base.superpose(forces)
        return self._buckling.checked(load, answer)


def prepare(case: Case, model: kinds.WarpedCompliance) -> Stored:
    """Find the rotations of every stored response, or of its limit, and fit the residual."""
    case = at_limit(case) if model.target else case
    return Stored(case, WarpedResponse(case.meshes, case.use_compliance()), model.samples)
