"""The motion of a scene: positions, energies and contacts over time, written as HDF5 or as a series for ParaView."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.errors import InputError, suggest
from palpate.files import write_whole
from palpate.setting_types import Where, check
from palpate.stores import store


@dataclass(frozen=True, eq=False)
class Moved:
    """A rigid obstacle, or another thing that pictures show, over time, in f frames.

    positions : (f, k, 3) [m] of its points; a ball is one point, a capsule two
    triangles : (m, 3) between the points; radius_m : thickness around them [m]
    """

    name: str
    kind: str
    radius_m: float
    positions: np.ndarray
    triangles: np.ndarray


@dataclass(frozen=True, eq=False)
class Motion:
    """A scene over time, in f frames.

    times : (f,) [s]; positions : (f, n, 3) and rest : (n, 3) [m]
    triangles : (t, 3) of the surface; tetrahedra : (m, 4), if any; held : (k,) nodes held still
    energy : one row for each frame: time_s, kinetic_j, a column ``<effect>_j`` for each energy, outer_work_j, total_j,
        and gain_j, the most that total_j has risen in a step beyond the work of that step; for a motion in modes also
        doubt_m, its own estimate of its error [m], infinite where it has none
    obstacles : rigid things that the body could meet
    observed : one row for each step: time_s and the numbers that effects observe
    contacts : one row for each contact and frame, with place, direction, gap, relative velocity, force
    up : the axis, 0 to 2, that is upright in pictures; drawn : what they show besides, such as threads
    """

    scene: str
    times: np.ndarray
    positions: np.ndarray
    rest: np.ndarray
    triangles: np.ndarray
    tetrahedra: np.ndarray
    held: np.ndarray
    energy: pd.DataFrame
    obstacles: tuple[Moved, ...] = ()
    observed: pd.DataFrame = field(default_factory=pd.DataFrame)
    contacts: pd.DataFrame = field(default_factory=pd.DataFrame)
    up: int = 2
    drawn: tuple[Moved, ...] = ()

    def __repr__(self) -> str:
        frames, nodes, _ = self.positions.shape
        return f"<Motion {self.scene}: {frames} frames of {nodes} nodes, {self.times[0]:g} to {self.times[-1]:g} s>"

    def force(self, name: str) -> np.ndarray:
        """Return the force (s, 3) [N] of an instrument or a hook on the bodies at the end of each of s steps.

        Of a thread it is the force at its second end.
        name : "floor_0", its own if it has one, or the kind alone if there is only one; times are in ``observed``
        Raises InputError for a name that nothing has.
        """
        check(name=(str, name))
        felt_by = [column.removesuffix("_force_x_n") for column in self.observed if column.endswith("_force_x_n")]
        names = [name] if name in felt_by else [thing for thing in felt_by if name == thing.rpartition("_")[0]]
        if len(names) != 1:
            remedy = suggest(name, felt_by, "there are") if felt_by else "add an instrument, a hook or a thread."
            raise InputError(f"no force is felt by {name}; {remedy}")
        return -self.observed[[f"{names[0]}_force_{axis}_n" for axis in "xyz"]].to_numpy()

    def save(self, path: Path | str) -> None:
        """Write the motion to a file: an animation (.gif), stills (.png), all of it (.h5), or a series (.pvd)."""
        check(path=(Where, path))
        if (kind := Path(path).suffix.lower()) == ".h5":
            store(self, path)
        elif kind == ".pvd":
            write_series(replace(self, scene=Path(path).stem), Path(path).parent)
        else:
            from palpate import pictures

            pictures.motion(self, path)

    def _repr_png_(self) -> bytes:
        from palpate import pictures

        return pictures.stills(self)

    def instrument_forces(self) -> np.ndarray:
        """Return the mean force of each of the k obstacles on the bodies between two frames, (f − 1, k, 3) [N].

        An integrator whose steps have stages records the mean over each step, ``<name>_mean_force_x_n`` …, in
        ``observed``. For others it is found by the trapezoidal rule from the force at the end of each step,
        ``<name>_force_x_n`` …, zero before the first step; of explicit integrators, whose contact forces alternate
        between none and too large ones, only the mean over many steps is meaningful. k is 0 without such columns.
        """
        means = [f"{obstacle.name}_mean_force_{letter}_n" for obstacle in self.obstacles for letter in "xyz"]
        has_means = bool(means) and set(means) <= set(self.observed)
        columns = means if has_means else [column.replace("_mean_force_", "_force_") for column in means]
        if not columns or not set(columns) <= set(self.observed):
            return np.zeros((len(self.times) - 1, 0, 3))
        forces = np.vstack([np.zeros(len(columns)), -self.observed[columns].to_numpy()])
        times = np.append(0.0, self.observed["time_s"])
        impulse_parts = np.diff(times)[:, None] * (forces[1:] if has_means else 0.5 * (forces[1:] + forces[:-1]))
        impulses = np.vstack([np.zeros(len(columns)), np.cumsum(impulse_parts, axis=0)])
        frame_steps = np.searchsorted(times, self.times * (1.0 - 1e-9))
        mean_forces = np.diff(impulses[frame_steps], axis=0) / np.diff(self.times)[:, None]
        return mean_forces.reshape(len(mean_forces), -1, 3)


def write_series(motion: Motion, folder: Path | str) -> Path:
    """Write ``<scene>_0000.vtu`` … and ``<scene>.pvd``, which names them with their times; return the latter.

    Each frame holds the tetrahedra (of a sheet or surface the triangles), the positions of all particles [m], their
    displacement from rest (``displacement_m``), and ``held``, 1 for a held particle. The index is written last, so it
    never names a missing frame; frames of an earlier, longer series are removed.
    """
    folder = Path(folder)
    index = folder / f"{motion.scene}.pvd"
    index.unlink(missing_ok=True)
    for earlier_frame in folder.glob(f"{motion.scene}_[0-9]*.vtu"):
        earlier_frame.unlink()
    entries = ""
    for frame, (time, positions) in enumerate(zip(motion.times, motion.positions, strict=True)):
        name = f"{motion.scene}_{frame:04d}.vtu"
        _write_frame(motion, positions, folder / name)
        entries += f'    <DataSet timestep="{float(time)!r}" part="0" file="{name}"/>\n'
    with write_whole(index) as unfinished:
        unfinished.write_text(
            '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
            f"  <Collection>\n{entries}  </Collection>\n</VTKFile>\n",
            encoding="utf-8",
        )
    return index


def _write_frame(motion: Motion, positions: np.ndarray, path: Path) -> None:
    import meshio

    held = np.zeros(len(positions), dtype=np.int8)
    held[motion.held] = 1
    data = {"displacement_m": positions - motion.rest, "held": held}
    cells = ("tetra", motion.tetrahedra) if len(motion.tetrahedra) else ("triangle", motion.triangles)
    with write_whole(path) as part:
        meshio.Mesh(positions, [cells], point_data=data).write(part, file_format="vtu")
