"""Draw surfaces into small PNG files, for the other examples."""

import numpy as np
import pyvista
from PIL import Image
from vtkmodules.vtkCommonCore import vtkLogger

BAR = {"color": "black", "fmt": "%.3g", "n_labels": 3, "vertical": True, "height": 0.6}
PLACE = {"position_x": 0.86, "position_y": 0.2, "width": 0.06}


def surfaces(picture, parts, view=(0.3, -1.5, 0.8), title="", lines=None, zoom=1.4) -> None:
    """Render ``parts``, each (nodes, triangles, look) with keywords of pyvista's add_mesh, to the file ``picture``.

    view : from the body towards the eye; title : of the colour bar; lines : (k, 2, 3) [m], drawn in red
    """
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)  # without a display VTK tries X first, and says so
    plotter = pyvista.Plotter(off_screen=True, window_size=(640, 360))
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    for nodes, triangles, look in parts:
        mesh = pyvista.PolyData.from_regular_faces(np.asarray(nodes, dtype=float), triangles)
        bar = {"scalar_bar_args": BAR | PLACE | {"title": title}} if "scalars" in look else {}
        plotter.add_mesh(mesh, **({"edge_color": "#666666", "ambient": 0.35} | bar | look))
    if lines is not None:
        segments = pyvista.line_segments_from_points(lines.reshape(-1, 3))
        plotter.add_mesh(segments.tube(radius=0.006 * segments.length), color="#cc2222")
    plotter.camera_position = [np.asarray(view), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]
    plotter.reset_camera()
    plotter.camera.zoom(zoom)
    plotter.screenshot(picture)
    plotter.close()
    shrink(picture)


def shrink(picture) -> None:
    """Write a PNG file again with 64 colours."""
    Image.open(picture).convert("RGB").quantize(64).save(picture, optimize=True)
