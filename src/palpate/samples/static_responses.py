"""Press a body: simulate the static response to each load of a table, and record what it cost."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import pandas as pd

from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_of, row_of
from palpate.errors import NotConverged
from palpate.files import read_hdf5, write_whole
from palpate.samples.loads import nodal_forces
from palpate.solvers.equilibrium import Equilibrium


@dataclass(frozen=True, eq=False)
class Responses:
    """Responses of one level of a body to k loads.

    sample : (k,) numbers from the load table
    displacement : (k, n_nodes, 3) [m]
    newton_iterations, linear_solves, residual, seconds : (k,) what each solution took and reached
    """

    sample: np.ndarray
    displacement: np.ndarray
    newton_iterations: np.ndarray
    linear_solves: np.ndarray
    residual: np.ndarray
    seconds: np.ndarray

    def costs(self) -> pd.DataFrame:
        """Tabulate one row a sample: newton_iterations, linear_solves, residual, seconds."""
        names = ["sample", "newton_iterations", "linear_solves", "residual", "seconds"]
        return pd.DataFrame({name: getattr(self, name) for name in names})


def press(body: Body, level: int, loads: pd.DataFrame, tolerance: float, progress: Callable = iter) -> Responses:
    """Solve for every row of ``loads`` on one level, to the relative residual ``tolerance``.

    ``progress`` wraps the sequence of rows, as ``tqdm`` does. Raises InputError for a contact that cannot be
    pressed, NotConverged naming the sample.
    """
    able = contacts_of(body)
    for contact in loads["contact"]:
        row_of(able, int(contact), f"{body.name}, ")
    solver = Equilibrium(body, level)
    solver.energy(solver.mesh.nodes), solver.linearise(solver.mesh.nodes)  # compiled before the clock runs
    solutions = []
    for _, load in progress(list(loads.iterrows())):
        nodal = nodal_forces(body, level, load)
        try:
            solutions.append(solver.solve(nodal, tolerance))
        except NotConverged as failure:
            raise NotConverged(
                f"{body.name}, sample {load['sample']:.0f}: {failure}; lower the regime's peak_of_size, at which "
                "tissue may be pressed flat, or hold the body elsewhere (anchors).",
                failure.history,
            ) from failure
    return Responses(
        loads["sample"].to_numpy(),
        np.array([s.x for s in solutions]) - solver.mesh.nodes,
        np.array([s.iterations for s in solutions]),
        np.array([s.linear_solves for s in solutions]),
        np.array([s.history[-1] for s in solutions]),
        np.array([s.seconds[-1] for s in solutions]),
    )


def save_responses(responses: Responses, path: Path) -> None:
    """Write to HDF5, whole or not at all."""
    with write_whole(path) as temporary, h5py.File(temporary, "w") as file:
        for name in Responses.__dataclass_fields__:
            file.create_dataset(name, data=getattr(responses, name), fletcher32=True)


def load_responses(paths: Iterable[Path]) -> Responses:
    """Read and join what ``save_responses`` wrote, in the order of the paths."""
    parts: dict[str, list] = {name: [] for name in Responses.__dataclass_fields__}
    for path in paths:
        with read_hdf5(path) as file:
            for name, values in parts.items():
                values.append(file[name][:])
    return Responses(*(np.concatenate(values) for values in parts.values()))
