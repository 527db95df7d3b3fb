"""Answer from the load alone: POD modes of the samples, with coefficients by a Gaussian process or a network.

No mesh is simulated and no response stored. Both learners map no force to no displacement.
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import minimize

from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Solver
from palpate.bodies.contacts import contacts_of, row_of
from palpate.errors import NotConverged
from palpate.models import kinds
from palpate.models.coarse_answers import training_of
from palpate.models.enrichment.ridge import LAMBDAS, dual_weights
from palpate.models.near_buckling import NearBuckling

REACHES = np.geomspace(0.05, 3.0, 9)
"""Distances tried, over the body's size, at which two contacts know half of each other."""
SQUARES = (0.0, 0.3, 3.0)
"""Shares tried of the square of the product of two forces, beside the product, for forces of the usual strength."""
DECAYS = (1e-3, 1e-2, 1e-1)
"""Weight decays tried."""
DESCENTS = 300
"""Iterations of L-BFGS that a network is trained for."""


Folds = Sequence[tuple[np.ndarray, np.ndarray]]
"""The numbers of the samples that are learnt from and of those that are held out, for each fold."""


def gaussian_process(
    places: np.ndarray, forces: np.ndarray, targets: np.ndarray, folds: Folds, seed: int
) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Return a Gaussian process's mean by place and force; cross-validation chooses reach ℓ, share q, and noise.

    Its covariance is exp(−‖p − p'‖²/2ℓ²) (f·f' + q (f·f')²) of places p and forces f: near contacts answer alike, and
    nearly in proportion to the force.
    """

    def covariance(squared_distances: np.ndarray, products: np.ndarray, reach: float, square: float) -> np.ndarray:
        return np.exp(-0.5 * squared_distances / reach**2) * (products + square * products**2)

    squared_distances, products = np.sum((places[:, None] - places) ** 2, axis=2), forces @ forces.T
    best: tuple[float, tuple[float, float, float]] = (np.inf, (1.0, 0.0, 1.0))
    for reach in REACHES:
        for square in SQUARES:
            errors = _held_out(covariance(squared_distances, products, reach, square), targets, folds)
            best_noise = int(errors.argmin())
            best = min(best, (float(errors[best_noise]), (reach, square, float(LAMBDAS[best_noise]))))
    reach, square, noise = best[1]
    kernel = covariance(squared_distances, products, reach, square)
    dual = dual_weights(kernel, np.eye(len(kernel)), np.array([noise]))[0] @ targets

    def predict(place: np.ndarray, force: np.ndarray) -> np.ndarray:
        return covariance(np.sum((places - place) ** 2, axis=1), forces @ force, reach, square) @ dual

    return predict


def _held_out(kernel: np.ndarray, targets: np.ndarray, folds: Folds) -> np.ndarray:
    """Return the mean relative errors of held-out samples, for each of LAMBDAS, (len(LAMBDAS),)."""
    total = np.zeros(len(LAMBDAS))
    for train, validation in folds:
        weights = dual_weights(kernel[np.ix_(train, train)], kernel[np.ix_(train, validation)], LAMBDAS)
        predicted = np.swapaxes(weights, 1, 2) @ targets[train]
        total += _relative(predicted, targets[validation]).sum(axis=-1)
    return total / len(targets)


def _relative(predicted: np.ndarray, targets: np.ndarray) -> np.ndarray:
    lengths = np.maximum(np.linalg.norm(targets, axis=-1), np.finfo(float).tiny)
    return np.linalg.norm(predicted - targets, axis=-1) / lengths


def network(hidden: int) -> Callable:
    """Return a learner: a network of two layers of ``hidden`` tanh units, with weight decay by cross-validation.

    Its input is the place, standardised by mean and spread of the training samples'; its output are the first and
    second derivatives of the coefficients by the force.
    """

    def learn(
        places: np.ndarray, forces: np.ndarray, targets: np.ndarray, folds: Folds, seed: int
    ) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
        powers, size = _powers(forces), float(np.abs(targets).max()) or 1.0
        scaled = targets / size
        middle, spread = places.mean(axis=0), places.std(axis=0)
        spread = np.where(spread > 0.0, spread, 1.0)
        about = (places - middle) / spread

        def trained(rows: np.ndarray | slice, decay: float) -> list[np.ndarray]:
            return _trained(about[rows], powers[rows], scaled[rows], hidden, decay, seed)

        def error(decay: float) -> float:
            total = 0.0
            for train, validation in folds:
                predicted = _layered(trained(train, decay), about[validation], powers[validation])[2]
                total += float(_relative(predicted, scaled[validation]).sum())
            return total

        weights = trained(slice(None), min(DECAYS, key=error))  # on all samples

        def answer(place: np.ndarray, force: np.ndarray) -> np.ndarray:
            return size * _layered(weights, ((place - middle) / spread)[None], _powers(force[None]))[2][0]

        return answer

    return learn


def _powers(forces: np.ndarray) -> np.ndarray:
    """Return the components of forces (k, 3) and their six products: (k, 9)."""
    rows, columns = np.triu_indices(3)
    return np.hstack([forces, forces[:, rows] * forces[:, columns]])


def _trained(
    places: np.ndarray, powers: np.ndarray, targets: np.ndarray, hidden: int, decay: float, seed: int
) -> list[np.ndarray]:
    """Train a network by L-BFGS from a seeded start; return its weights, layer by layer, the last row for constants."""
    shapes = [(4, hidden), (hidden + 1, hidden), (hidden + 1, powers.shape[1] * targets.shape[1])]
    draw = np.random.default_rng(seed)
    start = np.concatenate([(draw.normal(size=shape) / np.sqrt(shape[0])).ravel() for shape in shapes])

    def loss(flat: np.ndarray) -> tuple[float, np.ndarray]:
        error, slopes = _slopes(_layers(flat, shapes), places, powers, targets)
        gradient = np.concatenate([slope.ravel() for slope in slopes]) + 2.0 * decay * flat
        return error + decay * float(flat @ flat), gradient

    result = minimize(loss, start, jac=True, method="L-BFGS-B", options={"maxiter": DESCENTS})
    return _layers(result.x, shapes)


def _layers(flat: np.ndarray, shapes: Sequence[tuple[int, int]]) -> list[np.ndarray]:
    ends = np.cumsum([rows * columns for rows, columns in shapes])
    return [part.reshape(shape) for part, shape in zip(np.split(flat, ends[:-1]), shapes, strict=True)]


def _layered(
    weights: list[np.ndarray], places: np.ndarray, powers: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return both hidden layers at places (k, 3), (k, hidden) each, and the coefficients (k, m) for powers (k, 9)."""
    hidden_1 = np.tanh(places @ weights[0][:-1] + weights[0][-1])
    hidden_2 = np.tanh(hidden_1 @ weights[1][:-1] + weights[1][-1])
    derivatives = (hidden_2 @ weights[2][:-1] + weights[2][-1]).reshape(len(places), powers.shape[1], -1)
    return hidden_1, hidden_2, np.einsum("kp,kpm->km", powers, derivatives)


def _slopes(
    weights: list[np.ndarray], places: np.ndarray, powers: np.ndarray, targets: np.ndarray
) -> tuple[float, list[np.ndarray]]:
    """Return the mean squared error of the coefficients, and its derivatives by the weights of each layer."""
    hidden_1, hidden_2, predicted = _layered(weights, places, powers)
    by_predicted = 2.0 * (predicted - targets) / len(places)
    by_output = (powers[:, :, None] * by_predicted[:, None, :]).reshape(len(places), -1)
    by_hidden_2 = (by_output @ weights[2][:-1].T) * (1.0 - hidden_2**2)
    by_hidden_1 = (by_hidden_2 @ weights[1][:-1].T) * (1.0 - hidden_1**2)
    layers = ((places, by_hidden_1), (hidden_1, by_hidden_2), (hidden_2, by_output))
    slopes = [np.vstack([inputs.T @ by_layer, by_layer.sum(axis=0)]) for inputs, by_layer in layers]
    return float(np.sum((predicted - targets) ** 2)) / len(places), slopes


HIDDEN = 8
"""Units of each hidden layer of a network of which nothing else is said."""
LARGEST_NORM = 1.5
"""Largest norm of an answer over that of the farthest sample; beyond it the model says that it does not know."""


class Learnt(Solver):
    """POD modes about rest of fine displacements, whose coefficients are learnt from the load.

    A learner takes places and forces (k, 3), coefficients (k, m), folds and a seed, and returns a function of one place
    and force. Places are over the body's size, forces over the root mean square of the training samples'.
    """

    def __init__(self, case: Case, model: kinds.PODOfLoads):
        training, learn = training_of(case), gaussian_process
        db = training.db
        if model.learner == "network":
            learn = network(model.hidden or HIDDEN)
        self._contacts, self._buckling = contacts_of(case.body), NearBuckling(case)
        fine = db.fine.reshape(len(db.fine), -1)
        values, vectors = np.linalg.eigh(fine @ fine.T)
        strongest = np.argsort(values)[::-1][: model.modes]
        lengths = np.sqrt(np.maximum(values[strongest], np.finfo(float).tiny))
        self._modes = (vectors[:, strongest] / lengths).T @ fine
        self._places = db.coarse_nodes / db.size
        self._strength = float(np.sqrt(np.mean(np.sum(db.force**2, axis=1)))) or 1.0
        places, forces = self._places[db.contact], db.force / self._strength
        self._learnt = learn(places, forces, vectors[:, strongest] * lengths, training.folds, training.options.seed)
        self._reach = float(np.linalg.norm(db.fine, axis=(1, 2)).max())

    def respond(self, load: Load) -> np.ndarray | Answer:
        """Answer as ``Solver`` does; NotConverged beyond the guard LARGEST_NORM, Doubted where the body may buckle."""
        contact, force = load.single()
        row_of(self._contacts, contact)
        moved = (self._learnt(self._places[contact], force / self._strength) @ self._modes).reshape(-1, 3)
        ratio = float(np.linalg.norm(moved)) / self._reach
        if not ratio <= LARGEST_NORM:
            raise NotConverged(f"this goes {ratio:.1f} times as far as any sample, beyond what is learnt", [ratio])
        return self._buckling.checked(load, moved)


prepare = Learnt
