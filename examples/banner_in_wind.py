"""An effect of one's own in a scene: a banner, held by its upper edge, hangs askew in the wind of wind.py."""

import sys
from pathlib import Path

import draw

from palpate.bodies.make_body import make_body
from palpate.bodies.particles import particles_of
from palpate.effects.settings import Bending, Gravity, Rayleigh
from palpate.scenes.run_scene import run
from palpate.scenes.settings import Scene

CLOTH = {"kind": "sheet", "sizes_m": [0.3, 0.2], "divisions": [12, 8], "thickness_m": 0.001, "young_pa": 1e5}
CLOTH |= {"poisson": 0.3, "density_kg_m3": 1000.0, "anchors": {"plane": {"axis": "x", "side": "min", "depth_m": 0.001}}}
WIND = {"own": {"wind": str(Path(__file__).with_name("wind.py"))}, "own_settings": {"wind": {"pressure_pa": 5.0}}}
ACTING = {"gravity": Gravity(acceleration_m_s2=[0, 0, -9.81]), "rayleigh": Rayleigh(mass_1_s=3.0, stiffness_s=0.0)}
SCENE = Scene(body="banner", step_s=0.05, duration_s=4.0, bending=Bending(), **ACTING, **WIND)


def main(picture=None):
    """Return the tangent of the banner's angle to the vertical over pressure / (density × thickness × g)."""
    cloth = particles_of(make_body("banner", CLOTH), level=0, surface=False)  # at rest it lies flat
    motion = run(SCENE, cloth).motion
    if picture:
        looks = {0: "#dcdcdc", 4: "#ecd9c3", 6: "#e8bd8e", -1: "#d9822b"}  # some of the frames
        shown = [(motion.positions[at], {"color": colour, "show_edges": at < 0}) for at, colour in looks.items()]
        banners = [(nodes, cloth.triangles, look) for nodes, look in shown]
        draw.surfaces(picture, banners, view=(0.5, -1.7, 0.5), zoom=1.1)
    x, _, z = motion.positions[-1][cloth.nodes[:, 0] == 0.3].mean(axis=0)  # of the lower edge
    return x / -z / (5.0 / (1000 * 0.001 * 9.81))


if __name__ == "__main__":
    print(f"tangent of the angle: {main(*sys.argv[1:]):.3f} of what a limp cloth has")
