"""An effect of one's own in a scene: a banner, held by its upper edge, hangs askew in the wind of wind.py."""

import sys

import draw
from wind import Wind

import palpate as pp

EDGE = pp.Plane(axis="x", side="min", depth_m=0.001)
CLOTH = pp.Sheet(sizes_m=(0.3, 0.2), divisions=(12, 8), thickness_m=0.001, young_pa=1e5, poisson=0.3, anchors=EDGE)
EFFECTS = [pp.Gravity(), pp.Bending(), pp.Rayleigh(mass_1_s=3, stiffness_s=0), Wind(pressure_pa=5.0)]


def main(picture=None):
    """Return the tangent of the banner's angle to the vertical over pressure / (density × thickness × g)."""
    motion = pp.simulate(CLOTH, EFFECTS, step_s=0.05, duration_s=4.0)  # at rest it lies flat
    if picture:
        looks = {0: "#dcdcdc", 4: "#ecd9c3", 6: "#e8bd8e", -1: "#d9822b"}  # some of the frames
        shown = [(motion.positions[at], {"color": colour, "show_edges": at < 0}) for at, colour in looks.items()]
        banners = [(nodes, motion.triangles, look) for nodes, look in shown]
        draw.surfaces(picture, banners, view=(0.5, -1.7, 0.5), zoom=1.1)
    x, _, z = motion.positions[-1][motion.rest[:, 0] == 0.3].mean(axis=0)  # of the lower edge
    return x / -z / (5.0 / (1000 * 0.001 * 9.81))


if __name__ == "__main__":
    print(f"tangent of the angle: {main(*sys.argv[1:]):.3f} of what a limp cloth has")
