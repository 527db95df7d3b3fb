"""Figures of bodies from a scan: slices, ray casting, masses of nodes, and the steps between."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.bodies import body_file
from palpate.bodies.body import Body
from palpate.bodies.ct.image import Image
from palpate.bodies.ct.mesh_from_ct import segment_entry
from palpate.bodies.settings import Ct
from palpate.bodies.surfaces.triangles import image_data
from palpate.errors import about
from palpate.report import render, style, tables
from palpate.run.job import stem, steps
from palpate.studies.ct import imaging
from palpate.studies.ct.imaging import BETWEEN, Pictures
from palpate.studies.ct.ray_casting import corners, front
from palpate.studies.ct.settings import Imaging

_SKIN, _MUSCLE, _BONE, _ORGAN = (0.98, 0.85, 0.76), (0.66, 0.32, 0.26), (0.96, 0.95, 0.92), (0.70, 0.20, 0.15)
_ORGAN_HU, _GAP_HU, _DARK_HU, _BRIGHT_HU = -3000, -1000, -250, 0

CLASSES = [
    (_ORGAN_HU, _ORGAN, 0.70),
    (-1600, _ORGAN, 0.70),
    (-1300, _SKIN, 0.0),
    (-400, _SKIN, 0.0),
    (-250, _SKIN, 0.006),
    (-60, _SKIN, 0.004),
    (0, _MUSCLE, 0.012),
    (130, _MUSCLE, 0.016),
    (220, _BONE, 0.06),
    (500, _BONE, 0.60),
]
"""Corners of the classification: value, colour, opacity per millimetre. Gaps and lungs are transparent, skin and fat
light and nearly transparent, muscle is darker, bone grey-white."""


def values(image: Image, mask: np.ndarray) -> np.ndarray:
    """Compute the values for CLASSES, (nz, ny, nx) int16: CT numbers [HU], and far below all of them in the organ.

    An MRI's tissue, where it is brighter than Otsu's threshold, gets values of skin to muscle by its brightness.
    The mask's steps between slices are smoothed, because shading would show them. Trap: the organ's values must lie
    below those of gaps, so that interpolation between the organ and its neighbours gives no other opaque class.
    """
    from scipy import ndimage

    blur = 0.5 * max(image.spacing_m) / np.array(image.spacing_m[::-1])
    organ = ndimage.gaussian_filter(mask.astype(np.float32), blur)
    return np.rint(organ * _ORGAN_HU + (1 - organ) * np.minimum(_numbers(image), CLASSES[-1][0])).astype(np.int16)


def _numbers(image: Image) -> np.ndarray:
    """Return the CT numbers, or for an MRI values between those of gaps and of muscle."""
    if image.modality == "ct":
        return image.hu
    import SimpleITK

    grey = image.hu.astype(np.float32)
    tissue = SimpleITK.GetArrayFromImage(SimpleITK.OtsuThreshold(SimpleITK.GetImageFromArray(grey), 0, 1)) > 0
    if not tissue.any():
        return np.full_like(grey, _GAP_HU)
    dark, bright = np.percentile(grey[tissue], [0, 99])
    return np.where(tissue, np.interp(grey, [dark, max(bright, dark + 1e-6)], [_DARK_HU, _BRIGHT_HU]), _GAP_HU)


_WINDOW = (-160, 240)  # [HU], the usual window for the abdomen
_OUTLINE = "#ffb000"

# name, normal axis of the array, and the array axes that point right and up in the picture
_SLICES = (("axial", 0, 2, 1), ("coronal", 1, 2, 0), ("sagittal", 2, 1, 0))
_ENDS = {2: ("right", "left"), 1: ("front", "back"), 0: ("feet", "head")}


@style.figure("ct_slices")
def draw_ct_slices(image: Image, mask: np.ndarray, name: str) -> Figure:
    """Draw slices through the middle of the organ ``mask``, (nz, ny, nx) bool, of the body ``name``, to one scale.

    Radiological convention: the patient's right is on the left, the front is at the top of the axial slice.
    """
    size = 1e3 * np.array(image.hu.shape) * image.spacing_m[::-1]
    widths = [size[a] for _, _, a, _ in _SLICES]
    tallest = max(size[u] for _, _, _, u in _SLICES)
    figure, (axes,) = style.panels(1, 3, (_INCHES, _INCHES * tallest / sum(widths) + 0.4), width_ratios=widths)
    for axis, (plane, cut_axis, right, up) in zip(axes, _SLICES, strict=True):
        index = _richest(mask, cut_axis)
        axis.set_title(f"{plane}, {1e3 * image.to_world(np.eye(3)[cut_axis] * index)[2 - cut_axis]:.0f} mm")
        _slice(axis, image, mask, (cut_axis, index), (right, up))
    figure.suptitle(name, x=0.01, ha="left", fontsize=9, fontweight="bold")
    return figure


def _richest(mask, cut: int) -> int:
    """Find the index along an axis at which the organ's cross-section is largest."""
    return int(mask.sum(axis=tuple(axis for axis in range(3) if axis != cut)).argmax())


def _slice(axis, image, mask, cut: tuple[int, int], shown: tuple[int, int]) -> None:
    """Draw one slice with axes in mm; ``cut`` is its normal axis and index, ``shown`` the axes to the right and up."""
    right, up = shown
    grey, inside = np.take(image.hu, cut[1], axis=cut[0]), np.take(mask, cut[1], axis=cut[0])
    first_corner = 1e3 * (image.to_world(np.full(3, -0.5)))
    last_corner = 1e3 * image.to_world(np.array(image.hu.shape) - 0.5)
    extent = (first_corner[2 - right], last_corner[2 - right], first_corner[2 - up], last_corner[2 - up])
    ct = image.modality == "ct"
    darkest, brightest = _WINDOW if ct else (float(image.hu.min()), float(np.percentile(image.hu, 99)))
    axis.imshow(grey, cmap="gray", vmin=darkest, vmax=brightest, extent=extent, origin="lower", aspect="equal")
    places = [1e3 * (image.origin_m[2 - a] + image.spacing_m[2 - a] * np.arange(image.hu.shape[a])) for a in shown]
    if inside.any():
        axis.contour(*places, inside.astype(float), [0.5], colors=_OUTLINE, linewidths=1.1)
    if up == 1:
        axis.invert_yaxis()
    axis.grid(False)
    axis.set_xlabel("{} – {} [mm]".format(*_ENDS[right]))
    axis.set_ylabel("{} – {} [mm]".format(*(_ENDS[up][::-1] if up == 1 else _ENDS[up])))


_PIXELS, _VOLUME_INCHES = 720, 3.3
_STEP = 0.5  # of the smallest voxel side, between samples along a ray


@style.figure("ct_volume_rendering")
def draw_ct_volume_rendering(image: Image, mask: np.ndarray, body: Body) -> Figure:
    """Draw the CT by ray casting, then the coarse and the fine surface of ``body``; dark balls are held nodes.

    Classification, then one ray a pixel with evenly spaced trilinear samples, shaded by normals from central
    differences and composited front to back (paper 3, chapter 2).
    """
    axes = front()
    view = render.frame(axes, [corners(image)])
    aspect = view.width / view.height
    size = _PIXELS, round(_PIXELS / aspect)
    with render.Stage(*size) as stage:
        pictures = {"ray casting": stage.picture(view, [lambda s: s.volume(_volume(image, mask))])}
    close = render.frame(axes, [body.coarse.nodes])
    with render.Stage(*size) as stage:
        for name, level in (("coarse", 0), ("fine", len(body.levels) - 1)):
            mesh = body.levels[level]
            pictures[f"{name} surface: {len(mesh.surface):,} nodes"] = stage.level(close, mesh, body.supported(level))
    figure, grid = style.grid(1, len(pictures), aspect, _VOLUME_INCHES, bare=True)
    for axis, (caption, picture) in zip(grid[0], pictures.items(), strict=True):
        style.place(axis, picture, caption)
    grid[0, 0].set_ylabel(body.name, fontweight="bold")
    return figure


def _volume(image: Image, mask: np.ndarray):
    """Convert the CT to a VTK volume for VTK's ray caster on the processor, which needs no graphics card.

    That caster terminates rays early: a ray ends when less than 1 % of the light from behind would pass. It also skips
    empty blocks. Traps: by default it casts fewer rays on a slower machine; skipping fails for voxels of four
    components, so that classes must be encoded in one value.
    """
    import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401  registers the caster's rendering backend
    from vtkmodules.vtkRenderingCore import vtkVolume
    from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper

    mapper = vtkFixedPointVolumeRayCastMapper()
    mapper.SetInputData(image_data(values(image, mask), image.origin_m, image.spacing_m))
    mapper.SetAutoAdjustSampleDistances(False)
    mapper.SetImageSampleDistance(1.0)
    mapper.SetNumberOfThreads(1)
    mapper.SetSampleDistance(_STEP * float(min(image.spacing_m)))

    volume = vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(_look())
    return volume


def _look():
    """Set colour, opacity and shading by CLASSES; ambient plus diffuse light stay below 1, above which values wrap."""
    from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
    from vtkmodules.vtkRenderingCore import vtkColorTransferFunction, vtkVolumeProperty

    colours, opacities = vtkColorTransferFunction(), vtkPiecewiseFunction()
    for value, colour, opacity in CLASSES:
        colours.AddRGBPoint(value, *colour)
        opacities.AddPoint(value, opacity)
    look = vtkVolumeProperty()
    look.SetColor(colours)
    look.SetScalarOpacity(opacities)
    look.SetScalarOpacityUnitDistance(1e-3)
    look.SetInterpolationTypeToLinear()
    look.ShadeOn()
    look.SetAmbient(0.3)
    look.SetDiffuse(0.65)
    return look


_INCHES = 10.5
_FOUND, _TRUE = "#d55e00", "#009e73"


@style.figure("ct_imaging")
def draw_ct_imaging(shown: Pictures, mask_interpolation: pd.DataFrame) -> Figure:
    """Draw pictures of the synthetic abdomen by ray casting, its MRI with what is found, and interpolated masks."""
    ray_cast = shown.taken.shape[0] / shown.taken.shape[1]
    figure, axes = style.panels(2, 4, (_INCHES, _INCHES / 4 * (ray_cast + 0.75) + 0.9), height_ratios=(ray_cast, 0.75))
    for axis, (caption, picture) in zip(axes[0], shown.cast.items(), strict=False):
        _picture(axis, caption).imshow(np.clip(picture, 0, 1), interpolation="none")
    samples_axis = _picture(axes[0, 3], "samples taken of each ray")
    bar = samples_axis.imshow(shown.taken, cmap="YlGnBu", vmin=0, vmax=1, interpolation="none")
    figure.colorbar(bar, ax=samples_axis, orientation="horizontal", shrink=0.7, pad=0.02, label="share of the samples")
    for axis, (image, segmented), caption in zip(axes[1], shown.mris, ("MRI as it is", "MRI, evened"), strict=False):
        _mri(_picture(axis, caption), image, segmented, shown.liver)
    lower_right = axes[1, 2].get_subplotspec()
    for axis in axes[1, 2:]:
        axis.remove()
    _masks(figure.add_subplot(lower_right.get_gridspec()[1, 2:]), mask_interpolation)
    return figure


def _picture(axis: Axes, caption: str) -> Axes:
    axis.set(title=caption, xticks=[], yticks=[])
    axis.grid(False)
    axis.spines[:].set_visible(False)
    return axis


def _mri(axis: Axes, image: Image, segmented: np.ndarray, liver: np.ndarray) -> None:
    """Draw the axial slice in the middle of the true liver, with the outlines of what is found and of the truth."""
    index = _richest(liver, 0)
    steps = image.spacing_m[1] / image.spacing_m[0]
    axis.imshow(image.hu[index], cmap="gray", vmin=0, vmax=np.percentile(image.hu, 99), aspect=steps)
    for mask, colour, line in ((liver, _TRUE, "--"), (segmented, _FOUND, "-")):
        if mask[index].any():
            axis.contour(mask[index].astype(float), [0.5], colors=colour, linewidths=1.1, linestyles=line)
    axis.plot([], [], color=_TRUE, ls="--", label="truth")
    axis.plot([], [], color=_FOUND, label="found")
    # on black of its own: the body is bright
    axis.legend(
        loc="lower right", labelcolor="white", frameon=True, facecolor="black", framealpha=1.0, edgecolor="none"
    )


def _masks(axis: Axes, table: pd.DataFrame) -> None:
    """Draw the Dice coefficients of mask_interpolation.csv over n, by body; dotted : the nearest drawn slice."""
    for i, body in enumerate(tables.bodies(table)):
        for method, line in ((BETWEEN, "-"), (None, ":")):
            rows = tables.where(table, body=body)
            rows = rows[(rows["method"] == BETWEEN) == (method == BETWEEN)].sort_values("every")
            label = body if method else None
            colour = style.HUES[i % len(style.HUES)]
            axis.plot(rows["every"], rows["dice"], line, color=colour, marker="o", ms=3, label=label)
    axis.axhline(0.95, color=style.FAINT, lw=0.8)
    axis.plot([], [], ":", color=style.INK, label="nearest drawn slice")
    axis.set(title="masks from every n-th slice", xlabel="n", ylabel="Dice against the whole mask")
    axis.set_ylim(top=1.005)
    axis.legend(loc="lower left")


_ENOUGH, _BOUND, _PAPERS = 6000, 1.0, 3.5  # elements; deviations [%]


@style.figure("node_mass", tables=("node_mass",))
def draw_node_mass(node_mass) -> Figure:
    """Draw the deviation of the total mass, with and without correction at the organ's rim, and the mean density."""
    figure, ((left, right),) = style.panels(1, 2, (9.5, 3.9))
    for i, body in enumerate(tables.bodies(node_mass)):
        rows = tables.where(node_mass, body=body).sort_values("elements")
        colour = style.HUES[i % len(style.HUES)]
        left.plot(rows["elements"], 100 * rows["raw_deviation"], color=colour, ls="--", marker="o", ms=3, alpha=0.7)
        left.plot(rows["elements"], 100 * rows["deviation_from_voxels"], color=colour, marker="o", ms=4, label=body)
        right.plot(rows["elements"], rows["mean_density_kg_m3"], color=colour, marker="o", ms=4, label=body)
    elements = node_mass["elements"]
    left.axhspan(-_PAPERS, _PAPERS, color="#f3f3f3", zorder=0)
    note = {"textcoords": "offset points", "fontsize": 8}
    left.annotate(f"±{_PAPERS:g} %: paper 2's meshes", (elements.min(), _PAPERS), (0, -10), **note)
    if elements.max() > _ENOUGH:
        left.fill_between([_ENOUGH, elements.max()], -_BOUND, _BOUND, color="#dcdcdc", lw=0, zorder=0.5)
        bound_text = f"±{_BOUND:g} % from {_ENOUGH} elements"
        left.annotate(bound_text, (elements.max(), _BOUND), (0, 3), ha="right", **note)
    left.plot([], [], color=style.INK, label="densities of the organ only")
    left.plot([], [], color=style.INK, ls="--", alpha=0.7, label="densities of all voxels (paper 2)")
    left.set(title="deviation of the total mass from the voxels", ylabel="deviation [%]")
    left.legend(loc="lower right")
    right.set(title="mean density", ylabel="total mass / volume [kg/m³]")
    low, high = right.get_ylim()
    right.set_ylim(min(low, high - 40), max(high, low + 40))
    right.legend(loc="lower right")
    for axis in (left, right):
        axis.set_xscale("log")
        axis.set_xlabel("elements")
        style.plain_log(axis.xaxis)
    return figure


def draw_ct(input: Any, output: Any, wildcards: Any, entry: Ct) -> None:
    """Draw slices and a volume rendering, for the rule of that name."""
    with about(f"bodies.{wildcards.body}"):
        image, mask = segment_entry(entry)
    image = replace(image, axes=np.eye(3))  # pictures are along the grid's own axes
    style.save(draw_ct_slices(image, mask, wildcards.body), stem(output.slices))
    style.save(draw_ct_volume_rendering(image, mask, body_file.load(input.body)), stem(output.volume))


def measure_imaging(output: Any, say: Callable, entries: dict[str, Ct], settings: Imaging) -> dict[str, pd.DataFrame]:
    """Measure images and draw the ones shown, for the rule of that name."""
    masks = {}
    for body, entry in entries.items():
        with about(f"bodies.{body}"):
            masks[body] = segment_entry(entry)
    measured, shown = imaging.measure(masks, settings, progress=steps(say, "imaging, table"))
    style.save(draw_ct_imaging(shown, measured["mask_interpolation"]), stem(output.figure))
    return measured
