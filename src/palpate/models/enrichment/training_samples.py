"""The training samples that methods are fitted to, divided into folds for cross-validation of widths and ridges."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from palpate.benchmark.database import Database
from palpate.benchmark.settings import FitOptions
from palpate.errors import InputError
from palpate.solvers.compliance import Compliance

SMALLEST_M, LARGEST_M = 1e-100, 1e100  # displacements [m] whose squares and cubes fits can compute with


@dataclass(frozen=True, eq=False)
class Training:
    """The k training samples of one ``protocol`` and the data beside them that methods may use.

    db : these samples alone, and the meshes of their body
    fold : (k,) the part of the cross-validation that each sample belongs to
    responses : linear responses of the fine and coarse meshes, for methods that use physics; see ``linear``
    """

    db: Database
    protocol: str
    options: FitOptions
    fold: np.ndarray
    responses: Compliance | None = None
    _shared: dict[Hashable, Any] = field(default_factory=dict)

    @property
    def coarse(self) -> np.ndarray:
        """The displacements of all coarse nodes, (k, N, 3) [m]."""
        return self.db.coarse(self.protocol)

    @property
    def described(self) -> np.ndarray:
        """The displacements of the coarse surface's nodes, flat, (k, 3 c) [m]."""
        return self.coarse[:, self.db.coarse_surface].reshape(len(self.coarse), -1)

    def linear(self) -> Compliance:
        """Return the linear responses; InputError where there are none."""
        if self.responses is None:
            raise InputError("enrichment: a method needs linear responses and has none; compute them first.")
        return self.responses

    def share(self, name: Hashable, make: Callable[[], Any]) -> Any:
        """Return what ``make`` makes, made once for all methods that ask for it by the same ``name``."""
        if name not in self._shared:
            self._shared[name] = make()
        return self._shared[name]

    @cached_property
    def folds(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """The numbers of the samples that are learnt from and of those that are held out, for each fold."""
        held_out = [self.fold == part for part in range(self.fold.max() + 1)]
        return [(np.flatnonzero(~part), np.flatnonzero(part)) for part in held_out]

    def errors(self, gram: np.ndarray, blends: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
        """Compute the RMSE / peak of each candidate and sample, (candidates, k), by cross-validation.

        gram : (k, k) inner products of the blended vectors [m²]
        blends(known, asked) : weights (candidates, known, asked) found from the known samples only
        """
        fold_errors, order = [], []
        for train, validation in self.folds:
            squared = blend_errors(
                blends(train, validation),
                gram[np.ix_(train, train)],
                gram[np.ix_(train, validation)],
                gram.diagonal()[validation],
            )
            fold_errors.append(np.sqrt(squared / self.db.fine.shape[1]) / self.db.peaks[validation])
            order.append(validation)
        return np.concatenate(fold_errors, axis=-1)[..., np.argsort(np.concatenate(order))]


def gather(db: Database, protocol: str, options: FitOptions, responses: Compliance | None = None) -> Training:
    """Return the training samples, all of ``db``, divided into folds.

    InputError if they are too few to divide, or so small or large that no body moves like that.
    """
    for name, moved in (("fine", db.fine), (f"coarse_{protocol}", db.coarse(protocol))):
        largest = float(np.abs(moved).max())
        if not (largest == 0.0 or SMALLEST_M <= largest <= LARGEST_M):
            raise InputError(
                f"enrichment: displacements {name} are up to {largest:.0e} m, whose squares no number can hold; "
                "check their unit."
            )
    fold = divide(db.contact if options.split == "contacts" else np.arange(len(db.contact)), options)
    return Training(db, protocol, options, fold, responses)


def divide(group: np.ndarray, options: FitOptions) -> np.ndarray:
    """Return each sample's fold, (k,), the same for all of a ``group`` (k,); as many as asked, or one a group."""
    names, member = np.unique(group, return_inverse=True)
    if len(names) < 2:
        raise InputError("enrichment: cross-validation needs two training contacts; raise train in config.")
    order = np.random.default_rng(options.seed).permutation(len(names))
    return order[member] % min(options.folds, len(names))


def convinces(errors: np.ndarray, plain: np.ndarray, fold: np.ndarray) -> bool:
    """Return whether cross-validated ``errors`` (k,) are lower than those of the ``plain`` method (k,) beyond chance.

    They are if the mean improvement of the folds, ``fold`` (k,), exceeds its standard error. The folds hold out what
    the split holds out, so that samples of one contact do not count as many.
    """
    gains = np.array([(plain - errors)[fold == part].mean() for part in np.unique(fold)])
    return bool(gains.mean() > gains.std(ddof=1) / np.sqrt(len(gains)))


def blend_errors(weights: np.ndarray, among: np.ndarray, across: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Return the squared error ‖Σᵢ wᵢ fᵢ − f‖² [m²] of every blend from inner products alone, (..., q).

    weights : (..., k, q); among : (k, k) products fᵢ·fⱼ; across : (k, q) products fᵢ·f; own : (q,) ‖f‖²
    Ordering and turning change no inner product, so this is the error on the body too. Cancellation leaves
    about 1e-8 of ‖f‖: enough to compare settings, not to show that a sample reproduces itself.
    """
    squared = own - 2 * (weights * across).sum(axis=-2) + (weights * (among @ weights)).sum(axis=-2)
    return np.maximum(squared, 0.0)
