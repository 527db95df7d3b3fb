"""Pictures of bodies, answers, motions and comparisons, for scripts and notebooks."""

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import InputError, explained
from palpate.setting_types import Where, check

if TYPE_CHECKING:
    from palpate.benchmark.load import Response
    from palpate.bodies.body import Body
    from palpate.scenes.motion import Motion

WIDTH, HEIGHT = 640, 400
"""Size of a picture of a surface [pixels]."""
EDGES = 3000
"""Triangles up to which their edges are drawn."""


def surface(nodes: np.ndarray, triangles: np.ndarray, moved: np.ndarray | None = None) -> np.ndarray:
    """Render a surface, (HEIGHT, WIDTH, 3) uint8.

    nodes : (n, 3) [m] where it is; triangles : (t, 3); moved : (n, 3) [m] from rest, by which it is coloured, or None
    """
    with explained():
        import pyvista
        from vtkmodules.vtkCommonCore import vtkLogger

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)  # without a display VTK tries X first, and says so
    plotter = pyvista.Plotter(off_screen=True, window_size=[WIDTH, HEIGHT])
    plotter.set_background("white")  # type: ignore[arg-type]
    plotter.enable_anti_aliasing("ssaa")
    mesh = pyvista.PolyData.from_regular_faces(np.asarray(nodes, dtype=float), triangles)
    look: dict[str, Any] = {
        "show_edges": len(triangles) <= EDGES,
        "edge_color": "#666666",
        "ambient": 0.35,
        "color": "#e2c2b3",
    }
    if moved is not None:
        place = {"position_x": 0.87, "position_y": 0.15, "width": 0.06, "height": 0.7, "vertical": True}
        bar = place | {"title": "mm", "color": "black", "fmt": "%.3g", "n_labels": 3}
        look |= {"scalars": 1e3 * np.linalg.norm(moved, axis=1), "cmap": "YlGnBu", "scalar_bar_args": bar}
    plotter.add_mesh(mesh, **look)
    plotter.camera_position = [(0.3, -1.5, 0.8), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    plotter.reset_camera()  # type: ignore[call-arg]
    plotter.enable_parallel_projection()  # type: ignore[call-arg]
    plotter.camera.zoom(1.25)
    image = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    return image


def check_path(path: str | Path | None, *endings: str) -> None:
    """Raise InputError, before anything is drawn, for a file of another ending, or in a folder that is not there."""
    if path is None:
        return
    check(path=(Where, path))
    if Path(path).suffix.lower() not in endings:
        raise InputError(f"{path}: this is written as {', '.join(endings)}; give such an ending.")
    if not Path(path).parent.is_dir():
        raise InputError(f"{path}: there is no folder {Path(path).parent}; make it first.")


def png(image: np.ndarray, path: str | Path | None = None) -> bytes:
    """Return an image (h, w, 3) uint8 as a PNG of 64 colours, and write it to ``path`` if there is one."""
    from PIL import Image

    file = BytesIO()
    Image.fromarray(image).quantize(64).save(file, format="png", optimize=True)
    if path is not None:
        Path(path).write_bytes(file.getvalue())
    return file.getvalue()


def body(drawn: "Body", path: str | Path | None = None) -> bytes:
    """Draw the surface of a body's finest level; return the PNG, and write it to ``path`` if there is one."""
    check_path(path, ".png")
    return png(surface(drawn.fine.nodes, drawn.fine.triangles), path)


def response(shown: "Response", path: str | Path | None = None) -> bytes:
    """Draw the surface of a pressed body, coloured by displacement; return the PNG, and write it to ``path``."""
    check_path(path, ".png")
    mesh, moved = shown.body.fine, np.zeros_like(shown.body.fine.nodes)
    moved[mesh.surface] = shown.displacement_m
    return png(surface(mesh.nodes + moved, mesh.triangles, moved), path)


def motion(shown: "Motion", path: str | Path) -> None:
    """Write a motion as an animation that loops (.gif), or four moments of it in a row (.png)."""
    check_path(path, ".gif", ".png", ".h5", ".pvd")
    if Path(path).suffix.lower() == ".gif":
        with explained():
            from palpate.studies.scenes import motion_pictures

        motion_pictures.animate(shown, path)
    else:
        Path(path).write_bytes(stills(shown))


def stills(shown: "Motion") -> bytes:
    """Return a PNG of four moments of a motion in a row."""
    with explained():
        from palpate.studies.scenes import motion_pictures

    file = BytesIO()
    motion_pictures.stills(shown, 4).savefig(file, format="png")
    return file.getvalue()
