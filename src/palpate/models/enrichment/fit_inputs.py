"""Gather all that methods of enrichment are fitted to, so that every method is fitted in the same way."""

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from palpate.benchmark.database import Database
from palpate.errors import InputError
from palpate.models.enrichment.training_samples import FitOptions, Training, gather
from palpate.solvers.compliance import Compliance


class Method(Protocol):
    """A fitted method; ``sigma_m`` is its kernel width [m], NaN if it has none."""

    sigma_m: float

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] from that of all coarse nodes (N, 3) [m], force (3,) [N]."""


@dataclass(frozen=True, eq=False)
class Fitting:
    """The training samples of one ``protocol``, and what else a method may use; methods look at no other sample.

    db : for its meshes
    responses : linear responses of the fine and coarse meshes, for methods that use physics; see ``linear``
    """

    db: Database
    training: Training
    protocol: str
    options: FitOptions
    responses: Compliance | None = None
    _shared: dict[Hashable, Any] = field(default_factory=dict)

    @staticmethod
    def of(
        db: Database, train: np.ndarray, protocol: str, options: FitOptions, responses: Compliance | None = None
    ) -> "Fitting":
        """Gather the samples ``train`` of ``db``; InputError if they are too few to divide into folds."""
        return Fitting(db, gather(db, train, protocol, options), protocol, options, responses)

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
