"""Volume rendering of a CT by ray casting, and the body made from it, from the same direction."""

import numpy as np
from matplotlib.figure import Figure

from palpate.bodies.body import Body
from palpate.bodies.ct.image import Image
from palpate.report import panels, render, style
from palpate.studies.ct.figures.ct_classes import CLASSES, values
from palpate.studies.ct.ray_casting import front

_PIXELS, _INCHES = 720, 3.3
_STEP = 0.5  # of the smallest voxel side, between samples along a ray


@style.styled
def draw(image: Image, mask: np.ndarray, body: Body) -> Figure:
    """Draw the CT by ray casting, then the coarse and the fine surface of ``body``; dark balls are held nodes.

    Classification, then one ray a pixel with evenly spaced trilinear samples, shaded by normals from central
    differences and composited front to back (paper 3, chapter 2).
    """
    view = _view(_corners(image))
    aspect = view.width / view.height
    size = _PIXELS, round(_PIXELS / aspect)
    with render.Stage(*size) as stage:
        pictures = {"ray casting": stage.picture(view, [lambda s: s.volume(_volume(image, mask))])}
    close = _view(body.coarse.nodes)
    with render.Stage(*size) as stage:
        for name, mesh, held in zip(
            ("coarse", "fine"), (body.coarse, body.fine), (body.anchors[0], body.anchors[-1]), strict=True
        ):
            pictures[f"{name} surface: {len(mesh.surface):,} nodes"] = stage.level(close, mesh, held)
    figure, axes = panels.grid(1, len(pictures), aspect, _INCHES, bare=True)
    for axis, (caption, picture) in zip(axes[0], pictures.items(), strict=True):
        panels.place(axis, picture, caption)
    axes[0, 0].set_ylabel(body.name, fontweight="bold")
    return figure


def _view(points: np.ndarray) -> render.View:
    """Choose a view from the front, slightly from the patient's right and from above; z is up."""
    return render.frame(front(), [points])


def _corners(image: Image) -> np.ndarray:
    """Return the corners of the grid, (8, 3) [m]."""
    last = np.array(image.hu.shape) - 1
    return image.to_world(np.array(list(np.ndindex(2, 2, 2))) * last)


def _volume(image: Image, mask: np.ndarray):
    """Convert the CT to a VTK volume for VTK's ray caster on the processor, which needs no graphics card.

    That caster terminates rays early: a ray ends when less than 1 % of the light from behind would pass. It also skips
    empty blocks. Traps: by default it casts fewer rays on a slower machine; skipping fails for voxels of four
    components, so that classes must be encoded in one value.
    """
    import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401  registers the caster's rendering backend
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkRenderingCore import vtkVolume
    from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper

    data = vtkImageData()
    data.SetDimensions(*image.hu.shape[::-1])
    data.SetSpacing(*image.spacing_m)
    data.SetOrigin(*image.origin_m)
    data.GetPointData().SetScalars(numpy_to_vtk(values(image, mask).ravel(), deep=True))

    mapper = vtkFixedPointVolumeRayCastMapper()
    mapper.SetInputData(data)
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
