"""Slow changes of an MRI's brightness, which coils cause, evened out."""

from dataclasses import replace

import numpy as np

from palpate.bodies.ct.image import Image

# voxels along each side of the grid that the change is looked for on: it is slow, and a finer grid takes minutes
_COARSE, _ROUNDS = 24, (30, 30)


def even_brightness(image: Image) -> Image:
    """Divide an MRI by the slow change of its brightness: N4 (Tustison et al., IEEE Trans. Med. Imaging 29(6), 2010).

    The change is looked for where the grey values are above Otsu's threshold, on a grid of 24 voxels a side at most.
    The median there stays. Without it one range of grey values cannot fit an organ that is nearer to a coil at one end.
    """
    import SimpleITK

    grey = np.maximum(image.hu.astype(np.float32), 0)
    found = SimpleITK.GetImageFromArray(grey)
    found.SetSpacing((1e3 * image.spacing_m).tolist())
    coarse = SimpleITK.Shrink(found, [-(-count // _COARSE) for count in found.GetSize()])
    body = SimpleITK.OtsuThreshold(coarse, 0, 1)
    finder = SimpleITK.N4BiasFieldCorrectionImageFilter()
    finder.SetNumberOfThreads(1)
    finder.SetMaximumNumberOfIterations(list(_ROUNDS))
    finder.Execute(coarse, body)
    change = SimpleITK.GetArrayFromImage(finder.GetLogBiasFieldAsImage(found))
    even = grey / np.exp(change)
    inside = SimpleITK.GetArrayFromImage(SimpleITK.OtsuThreshold(found, 0, 1)) > 0
    return replace(image, hu=(even * (np.median(grey[inside]) / np.median(even[inside]))).astype(np.float32))
