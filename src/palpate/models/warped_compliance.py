"""Answer with stored linear responses, turned with the rotations that they have themselves: no mesh is simulated.

The responses are precomputed Green's functions (James and Pai 1999, "ArtDefo"); the warp is that of Choi and Ko (2005),
"Modal warping": each node's displacement is turned by the mean of the rotations that lead up to its own. With samples,
a kernel ridge on what the warp leaves is added.
"""

from functools import reduce

import numba
import numpy as np
from scipy import sparse

from palpate.benchmark.database import Database
from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, FitOptions, Setting, Solver, held_mb, one_stage, training_counts
from palpate.bodies.contacts import row_of
from palpate.bodies.mesh import TetMesh
from palpate.effects.linear_elements import shape_gradients
from palpate.models.depths import Discs
from palpate.models.enrichment.features import Ordered
from palpate.models.enrichment.fitting import Training, convinces, gather
from palpate.models.enrichment.ridge import KernelRidge
from palpate.models.linear_fem import LinearFem
from palpate.solvers.compliance import Compliance


class NodalSpins:
    """Rotation vectors ½ curl u of a mesh's nodes: the volume-weighted mean of the elements around each."""

    def __init__(self, mesh: TetMesh):
        self._tetrahedra = mesh.tetrahedra
        self._gradients, volumes = shape_gradients(mesh)
        rows, columns = mesh.tetrahedra.ravel(), np.repeat(np.arange(len(volumes)), 4)
        around = sparse.csr_array((np.repeat(volumes, 4), (rows, columns)), shape=(len(mesh.nodes), len(volumes)))
        self._mean = sparse.diags_array(1.0 / around.sum(axis=1)) @ around

    def of(self, displacement: np.ndarray) -> np.ndarray:
        """Return rotation vectors (n_nodes, 3) [rad] of a small ``displacement`` (n_nodes, 3) [m]; linear in it."""
        curl = np.cross(self._gradients, displacement[self._tetrahedra]).sum(axis=1)
        return self._mean @ (0.5 * curl)


@numba.njit(cache=True)
def turn(spins: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Turn each vector (n, 3) by its rotation vector (n, 3) [rad], by Rodrigues' formula."""
    return _combine(spins, vectors, 0)


@numba.njit(cache=True)
def warp(spins: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Apply to each vector (n, 3) the mean of the rotations by t times its rotation vector (n, 3), 0 ≤ t ≤ 1."""
    return _combine(spins, vectors, 1)


@numba.njit(cache=True)
def _combine(spins, vectors, mean):
    """Return v + p w × v + q w × (w × v), with p and q of the rotation or of its mean."""
    found = np.empty_like(vectors)
    for n in range(len(vectors)):
        w0, w1, w2 = spins[n, 0], spins[n, 1], spins[n, 2]
        v0, v1, v2 = vectors[n, 0], vectors[n, 1], vectors[n, 2]
        squared = w0 * w0 + w1 * w1 + w2 * w2
        if squared < 1e-8:  # the series; what is left out is below rounding
            first, second, third = 1.0 - squared / 6.0, 0.5 - squared / 24.0, 1.0 / 6.0 - squared / 120.0
        else:
            angle = np.sqrt(squared)
            first = np.sin(angle) / angle
            second, third = 2.0 * np.sin(0.5 * angle) ** 2 / squared, (1.0 - first) / squared
        p, q = (second, third) if mean else (first, second)
        c0, c1, c2 = w1 * v2 - w2 * v1, w2 * v0 - w0 * v2, w0 * v1 - w1 * v0
        found[n, 0] = v0 + p * c0 + q * (w1 * c2 - w2 * c1)
        found[n, 1] = v1 + p * c1 + q * (w2 * c0 - w0 * c2)
        found[n, 2] = v2 + p * c2 + q * (w0 * c1 - w1 * c0)
    return found


class WarpedResponse:
    """u = R̃(w) C f', with the rotation vectors w of C f', and the force f' turned back by the contact's rotation.

    R̃(w) is the mean of the rotations by t w, 0 ≤ t ≤ 1; the contact's rotation is that of C f. Rotations are those of
    the fine response at the coarse nodes, interpolated. Development, on training samples of the shipped cylinder and
    liver: those of the fine surface were worse, as its dents turn farther than the material below.
    """

    def __init__(self, db: Database, compliance: Compliance):
        spins = NodalSpins(TetMesh(db.coarse_nodes, db.coarse_tetrahedra))
        self._contacts, self._columns, self._prolongation = compliance.contacts, compliance.fine, db.prolongation
        self._spins = np.array([[spins.of(u) for u in columns] for columns in compliance.restricted])

    def answer(self, contact: int, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the fine surface displacement (n, 3) [m] and the rotation vectors (n, 3) [rad] of its nodes.

        InputError for a contact that is not prepared.
        """
        return self._warped([(row_of(self._contacts, contact), contact, force)])

    def superpose(self, presses: list[tuple[int, np.ndarray]]) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] under forces (3,) [N], each at its contact.

        Rotation vectors add up as linear responses do, and each force is turned back by the sum at its contact.
        """
        return self._warped([(row_of(self._contacts, contact), contact, force) for contact, force in presses])[0]

    def _warped(self, presses: list[tuple[int, int, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
        """Turn the sum of the responses to forces; presses : row, contact and force of each."""
        spins, moved = [], []
        for row, contact, force in presses:
            here = reduce(np.add, [other @ self._spins[of, :, contact] for of, _, other in presses])
            local = turn(-here[None], force[None])[0]
            spins.append(np.tensordot(local, self._spins[row], 1))
            moved.append(np.tensordot(local, self._columns[row], 1))
        turned = self._prolongation @ reduce(np.add, spins)
        return warp(turned, reduce(np.add, moved)), turned


KINDS = ("response", "force")
"""What describes a load: the linear response of the coarse surface nodes, which says where the force acts too; or the
force along the axes of its contact, as which all contacts are alike."""


Base = LinearFem | WarpedResponse
"""The answer that is known without samples."""


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


class Stored(Solver):
    """The answer of ``base``, and what was learnt beyond it if ``samples`` are learnt from."""

    def __init__(self, case: Case, base: Base, samples: int):
        self._base, self._residual, self._discs = base, None, Discs(case)
        if samples:
            db = case.first(samples).use_training()
            residual = LoadResidual(case.meshes, case.use_compliance(), base)
            self._residual = residual.learn(gather(db, np.arange(samples), "live", case.options), case.options)

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB]."""
        return held_mb([self._base, self._residual])

    def respond(self, load: Load) -> np.ndarray | Answer:
        """Return the displacement (n_surface, 3) [m] under ``load``; InputError for a bad contact.

        Without a residual, which samples of one press each have taught, responses to several presses add up, and
        discs may be pushed to a depth.
        """
        if self._residual is not None:
            return self._residual.respond(*load.single())
        given, pushed = load.parted()
        return self._discs.answer(load, self._base.superpose) if pushed else self._base.superpose(given)


def shares(case: Case, family: str) -> list[Setting]:
    """List how many training samples are learnt from."""
    return [{"samples": count} for count in training_counts(case, case.grid[family]["training_shares"])]


PREPARED, REDUCES, LAW = True, "p2", "warped linear"


def settings(case: Case) -> list[Setting]:
    """List how many training samples are learnt from; with none, the method is the published one."""
    return shares(case, "warped_compliance")


def prepare(case: Case, setting: Setting) -> Stored:
    """Find the rotations of every stored response, and fit the residual."""
    return Stored(case, WarpedResponse(case.meshes, case.use_compliance()), setting["samples"])


offline = one_stage(prepare)
