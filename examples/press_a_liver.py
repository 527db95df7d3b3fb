"""Press a liver with a fingertip, and draw how far its surface moves."""

import sys

import palpate as pp

BACK = pp.Plane(axis="y", side="max", depth_m=0.06)
LIVER = pp.Liver(length_m=0.2, refinements=1, young_pa=3000, poisson=0.3, anchors=BACK)


def main(picture=None):
    """Return the peak displacement [m] under 1 N, and over a hundred times that under 10 mN."""
    liver, elements = LIVER.make(), pp.FEM(order=1, tolerance=1e-8)
    press = pp.Press(node=liver.node_at([-0.03, -0.06, 0.02]), force_n=1.0, radius_m=0.02)
    firm, gentle = (elements.answer(liver, each) for each in (press, press.but(force_n=0.01)))
    if picture:
        firm.plot(picture)
    return firm.peak_m, firm.peak_m / (100 * gentle.peak_m)


if __name__ == "__main__":
    peak, stiffer = main(*sys.argv[1:])
    print(f"peak displacement {1e3 * peak:.1f} mm, {stiffer:.2f} of what a linear liver has")
