"""Press a liver with a fingertip, and draw how far its surface moves."""

import sys

import draw
import numpy as np

from palpate.bodies.make_body import make_body
from palpate.effects.patch_load import nodal_load
from palpate.solvers.equilibrium import Equilibrium

LIVER = {"kind": "liver", "length_m": 0.2, "refinements": 1, "young_pa": 3000.0, "poisson": 0.3}
LIVER |= {"density_kg_m3": 1000.0, "anchors": {"plane": {"axis": "y", "side": "max", "depth_m": 0.06}}}


def main(picture=None):
    """Return the peak displacement [m] under 1 N, and the share of force × way that the liver stores under 10 mN."""
    body = make_body("liver", LIVER)
    mesh, equilibrium = body.fine, Equilibrium(body, level=1)
    surface = body.coarse.surface
    contact = surface[np.linalg.norm(body.coarse.nodes[surface] - [-0.03, -0.06, 0.02], axis=1).argmin()]
    press = nodal_load(body, 1, contact, -1.0 * mesh.normals[contact], radius_m=0.02)  # (n_nodes, 3) [N]

    moved = equilibrium.solve(press, tolerance=1e-8).x  # (n_nodes, 3) [m]
    distance = np.linalg.norm(moved - mesh.nodes, axis=1)
    if picture:
        look = {"scalars": 1e3 * distance, "show_edges": True, "smooth_shading": True, "cmap": "YlGnBu"}
        draw.surfaces(picture, [(moved, mesh.triangles, look)], title="mm")

    gentle = equilibrium.solve(0.01 * press, tolerance=1e-10).x
    work = 0.01 * np.vdot(press, gentle - mesh.nodes)  # force × way; a linear body stores half of it
    return distance.max(), (equilibrium.energy(gentle) + work) / work


if __name__ == "__main__":
    peak, stored = main(*sys.argv[1:])
    print(f"peak displacement {1e3 * peak:.1f} mm; of force × way {stored:.3f} is stored under a gentle press")
