"""Write a motion as a series for ParaView: a mesh for each frame, and an index with the times."""

from pathlib import Path

import numpy as np

from palpate.errors import InputError
from palpate.files import write_whole
from palpate.scenes.motion import Motion


def write_series(motion: Motion, folder: Path | str) -> Path:
    """Write ``<scene>_0000.vtu`` … and ``<scene>.pvd``, which names them with their times; return the latter.

    Each frame holds the tetrahedra (of a sheet or surface the triangles), the positions of all particles [m], their
    displacement from rest (``displacement_m``), and ``held``, 1 for a held particle. The index is written last, so it
    never names a missing frame; frames of an earlier, longer series are removed. Raises InputError for a position that
    is not finite.
    """
    if not np.isfinite(motion.positions).all():
        raise InputError(f"scene {motion.scene}: positions are not finite; delete its motion and type make.")
    folder = Path(folder)
    index = folder / f"{motion.scene}.pvd"
    index.unlink(missing_ok=True)
    for old in folder.glob(f"{motion.scene}_[0-9]*.vtu"):
        old.unlink()
    names = [f"{motion.scene}_{frame:04d}.vtu" for frame in range(len(motion.times))]
    for name, positions in zip(names, motion.positions, strict=True):
        _write_frame(motion, positions, folder / name)
    entries = "".join(
        f'    <DataSet timestep="{float(time)!r}" part="0" file="{name}"/>\n'
        for time, name in zip(motion.times, names, strict=True)
    )
    with write_whole(index) as part:
        part.write_text(
            '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
            f"  <Collection>\n{entries}  </Collection>\n</VTKFile>\n",
            encoding="utf-8",
        )
    return index


def _write_frame(motion: Motion, positions: np.ndarray, path: Path) -> None:
    """Write one frame as VTK XML."""
    import meshio

    held = np.zeros(len(positions), dtype=np.int8)
    held[motion.held] = 1
    data = {"displacement_m": positions - motion.rest, "held": held}
    cells = ("tetra", motion.tetrahedra) if len(motion.tetrahedra) else ("triangle", motion.triangles)
    with write_whole(path) as part:
        meshio.Mesh(positions, [cells], point_data=data).write(part, file_format="vtu")
