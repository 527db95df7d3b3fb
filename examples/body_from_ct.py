"""Make a body of a CT: here of the synthetic abdomen, whose liver is known exactly."""

import sys

import draw
import matplotlib.pyplot as plt
import pyvista

import palpate as pp
from palpate.bodies.ct.segmentation import segment
from palpate.bodies.ct.synthetic_abdomen import abdomen

BACK = pp.Sphere(center_m=(-0.1, -0.015, 0.04), radius_m=0.04)
LIVER = pp.Ct(threshold_hu=(30, 120), surface_nodes=140, refinements=1, young_pa=3000, poisson=0.3, anchors=BACK)


def main(picture=None):
    """Return the body's volume over the true one, and the Dice coefficient of its voxels with the true ones."""
    body = LIVER.make()  # of your own CT: pp.Ct(image="scan.nii.gz", ...), or pp.load("scan.nii.gz")
    image, truth = abdomen()
    organ = segment(image, LIVER.threshold_hu)
    if picture:
        at, (_, y, x) = len(organ) // 2, image.to_world([[0, 0, 0], [0, *organ.shape[1:]]])[:, ::-1].T
        surface = pyvista.PolyData.from_regular_faces(body.fine.nodes, body.fine.triangles)
        cut = surface.slice(normal="z", origin=image.to_world([at, 0, 0])).points  # (n, 3) [m]
        figure, axis = plt.subplots(figsize=(4.6, 3.4), layout="constrained")
        axis.imshow(image.hu[at], cmap="gray", vmin=-200, vmax=200, extent=[*(1e3 * x), *(1e3 * y[::-1])])
        axis.contour(organ[at], levels=[0.5], colors="gold", extent=[*(1e3 * x), *(1e3 * y)])
        axis.plot(*(1e3 * cut[:, :2].T), "r.", markersize=2)
        axis.set(xlabel="x [mm]", ylabel="y [mm]", title="red: the body's surface")
        figure.savefig(picture)
        plt.close(figure)
        draw.shrink(picture)
    overlap = 2 * (organ & truth["liver"]).sum() / (organ.sum() + truth["liver"].sum())
    return body.fine.volumes.sum() / truth["volume_m3"], overlap


if __name__ == "__main__":
    print("{:.4f} of the true volume, Dice coefficient {:.4f}".format(*main(*sys.argv[1:])))
