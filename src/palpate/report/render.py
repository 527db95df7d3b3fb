"""Off-screen rendering of surfaces into images that matplotlib can place."""

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

_AZIMUTHS, _ELEVATIONS = (30.0, -30.0, 150.0, -150.0), (20.0, -20.0)
_DOWN = 0.7  # a surface whose normal points down by more than this may be viewed from below
_OBLIQUE = 0.5  # cosine between the contact's normal and the view: 60° shows both contact and indentation


@dataclass(frozen=True, eq=False)
class View:
    """An orthographic camera.

    axes : (3, 3), rows right, up and toward the viewer; centre : (3,) [m]; width, height : [m]
    """

    axes: np.ndarray
    centre: np.ndarray
    width: float
    height: float


def directions(nodes: np.ndarray, normal: np.ndarray, up: int | None = None) -> np.ndarray:
    """Choose view axes (3, 3): the longest side of the body (n, 3) across, the surface with ``normal`` visible.

    up : the coordinate axis that points up, or None for the body's second longest side. If it is given, the view is
    from above unless the normal points down.
    """
    extents = np.round(np.ptp(nodes, axis=0) / np.ptp(nodes), 3)
    order = [axis for axis in np.argsort(-extents, kind="stable") if axis != up]
    if up is not None:
        order.insert(1, up)
    across, upward, _ = np.eye(3)[order]
    depth = np.cross(across, upward)
    candidates, elevations = [], _ELEVATIONS if up is None or normal[up] < -_DOWN else _ELEVATIONS[:1]
    for elevation, azimuth in product(np.radians(elevations), np.radians(_AZIMUTHS)):
        toward = np.cos(elevation) * (np.cos(azimuth) * depth + np.sin(azimuth) * across)
        toward = toward + np.sin(elevation) * upward
        right = np.cross(upward, toward) / np.linalg.norm(np.cross(upward, toward))
        candidates.append(np.array([right, np.cross(toward, right), toward]))
    return min(candidates, key=lambda axes: round(abs(float(axes[2] @ normal) - _OBLIQUE), 3))


def frame(axes: np.ndarray, clouds: list[np.ndarray], margin: float = 1.08) -> View:
    """Compute the smallest view along ``axes`` that contains all points of all ``clouds``, (n, 3) each."""
    points = np.vstack(clouds) @ axes.T
    lowest, highest = points.min(axis=0), points.max(axis=0)
    width, height, _ = (highest - lowest) * margin
    return View(axes, (lowest + highest) / 2 @ axes, float(width), float(height))


def same_scale(views: list[View]) -> list[View]:
    """Enlarge all views to the width of the widest and the height of the highest."""
    width, height = max(v.width for v in views), max(v.height for v in views)
    return [View(v.axes, v.centre, width, height) for v in views]


def solid(points: np.ndarray, thing):
    """Make the PyVista surface of a rigid ``thing`` of ``scenes.motion`` whose points are at ``points`` (k, 3) [m]."""
    import pyvista

    if thing.kind == "sphere":
        return pyvista.Sphere(radius=thing.radius_m, center=points[0])
    if thing.kind == "capsule":
        axis = points[1] - points[0]
        length = float(np.linalg.norm(axis))
        return pyvista.Capsule(
            center=points.mean(axis=0),
            direction=axis if length else (0.0, 0.0, 1.0),
            radius=thing.radius_m,
            cylinder_length=length,
        ).triangulate()
    return pyvista.PolyData.from_regular_faces(points, thing.triangles)


class Stage:
    """One off-screen window, reused for all pictures; a context manager."""

    def __init__(self, width: int, height: int):
        import pyvista
        from vtkmodules.vtkCommonCore import vtkLogger

        # without a display VTK first tries X, prints a warning, and then uses EGL
        verbosity = vtkLogger.GetCurrentVerbosityCutoff()
        vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
        self._pyvista = pyvista
        self._plotter: Any = pyvista.Plotter(off_screen=True, window_size=[width, height])
        self._plotter.enable_anti_aliasing("ssaa")
        self._plotter.show(auto_close=False)
        vtkLogger.SetStderrVerbosity(verbosity)

    def __enter__(self) -> "Stage":
        return self

    def __exit__(self, *_) -> None:
        self._plotter.close()

    def picture(self, view: View, actors: list) -> np.ndarray:
        """Render ``actors``, functions that are given this stage, as (height, width, 3) uint8."""
        plotter = self._plotter
        plotter.suppress_rendering = True  # or each actor is rendered as it is added
        plotter.clear_actors()
        plotter.set_background("white")
        for actor in actors:
            actor(self)
        width, height = plotter.window_size
        plotter.camera.focal_point = view.centre
        plotter.camera.position = view.centre + view.axes[2] * 10 * (view.width + view.height)
        plotter.camera.up = view.axes[1]
        plotter.camera.parallel_projection = True
        plotter.camera.parallel_scale = max(view.height, view.width * height / width) / 2
        plotter.renderer.ResetCameraClippingRange()
        plotter.suppress_rendering = False
        plotter.render()
        return plotter.screenshot(return_img=True)

    def surface(self, nodes, triangles, values, limits, cmap, log=False, edges=False) -> None:
        """Add a surface, nodes (n, 3) [m], coloured by one value per node (n,) or, if None, in plain grey."""
        mesh = self._pyvista.PolyData.from_regular_faces(nodes, triangles)
        colour = {"color": "#d9d4cf"} if values is None else {"scalars": values, "clim": limits, "cmap": cmap}
        self._plotter.add_mesh(
            mesh, smooth_shading=True, split_sharp_edges=True, feature_angle=45.0, show_edges=edges,
            edge_color="#333333", line_width=0.6, ambient=0.45, diffuse=0.65, specular=0.05,
            show_scalar_bar=False, log_scale=log, **colour,
        )  # fmt: skip

    def volume(self, volume) -> None:
        """Add a vtkVolume, lit from the camera.

        Trap: its ray caster takes ambient light from lamps, which have none by default; one that has it replaces them.
        """
        lamp = self._pyvista.Light(light_type="headlight")
        lamp.SetAmbientColor(1, 1, 1)
        self._plotter.remove_all_lights()
        self._plotter.add_light(lamp)
        self._plotter.add_actor(volume)

    def level(self, view: View, mesh, held: np.ndarray) -> np.ndarray:
        """Render ``mesh`` in grey with its edges, and the nodes of ``held`` on its surface."""
        held_nodes = mesh.nodes[np.intersect1d(held, mesh.surface)]
        actors = [
            lambda s: s.surface(mesh.nodes, mesh.triangles, None, None, None, edges=True),
            lambda s: s.dots(held_nodes, 0.011 * mesh.size),
        ]
        return self.picture(view, actors)

    def dots(self, points, radius) -> None:
        """Add held nodes, (n, 3) [m], as dark balls."""
        ball = self._pyvista.Sphere(radius=radius, theta_resolution=12, phi_resolution=12)
        glyphs = self._pyvista.PolyData(np.asarray(points)).glyph(geom=ball, scale=False, orient=False)
        self._plotter.add_mesh(glyphs, color="#222222", ambient=0.4)

    def rigid(self, points, thing) -> None:
        """Add a rigid ``thing`` of ``scenes.motion`` in steel blue, with its points at ``points`` (k, 3) [m]."""
        look = {"color": "#8fa3b5", "ambient": 0.4, "specular": 0.2}
        if thing.kind == "floor":  # in one grey, independent of the light, that differs from the page
            look = {"color": "#d3d8dd", "lighting": False}
        self._plotter.add_mesh(solid(points, thing), smooth_shading=thing.kind != "mesh", **look)

    def arrow(self, contact, force, normal, length) -> None:
        """Add the force at a contact point: the arrow's tip is there for a push, its tail for a pull."""
        direction = np.asarray(force) / np.linalg.norm(force)
        start = contact - length * direction if direction @ normal < 0 else contact
        shape = self._pyvista.Arrow(
            start=start, direction=direction, scale=length, tip_length=0.35, tip_radius=0.13, shaft_radius=0.045
        )
        self._plotter.add_mesh(shape, color="#cc2222", ambient=0.5, smooth_shading=True, split_sharp_edges=True)
