"""Cut the shipped liver at random on two levels, in every way, and print the worst that comes of it.

    python tests/benchmarks/random_cuts.py --count 200

A seed is a blade near the skin, a disc, or a plane through a node, some within 1e-9 of nodes and faces; every second
seed two of them. A failure is an exception, an inverted element, tissue that is lost but by removal, or a stiffness of
what is held that is not positive definite. Softest: the smallest pivot of that stiffness over the smallest before the
cut. Quality is 1 for a regular tetrahedron and 0 for a flat one.
"""

import argparse
import sys
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from fixtures.bodies import LIVER
from fixtures.cut_cases import random_cuts, smallest_pivot

from palpate.bodies.cutting.conform import cut_body, qualities
from palpate.bodies.cutting.cut import Cuts
from palpate.bodies.cutting.ways import REMOVAL, WAYS, part
from palpate.bodies.make_body import make_body
from palpate.bodies.mesh import components
from palpate.bodies.mesh_quality import dihedral_angles
from palpate.errors import InputError

CONFORM = "conform"
LOST = 1e-9
"""Share of the volume that rounding may lose."""


def main() -> None:
    """Cut as often as the command line asks for, and print a row for each level and way."""
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("--count", type=int, default=200)
    asked.add_argument("--first", type=int, default=0, help="the first seed")
    asked.add_argument("--ways", nargs="+", default=[*WAYS, CONFORM])
    given = asked.parse_args()
    body, seeds = make_body("liver", LIVER), range(given.first, given.first + given.count)
    print("level,way,cuts,refused,failed,least_volume_m3,least_quality,least_angle_deg,softest,most_pieces,seconds")
    bad = 0
    for level in (0, 1):
        before = smallest_pivot(body.from_level(level).up_to(0))
        for way in given.ways:
            begin, rows, refused, failed = process_time(), [], 0, []
            for seed in seeds:
                try:
                    found, lost = cut_in(body, level, random_cuts(body, seed), way)
                    rows.append(worst(found, before))
                    if rows[-1][0] <= 0.0 or not rows[-1][3] > 0.0 or lost > LOST:
                        failed.append(f"{seed}: {rows[-1]}, lost {lost:.2g}")
                except InputError as error:
                    refused += 1
                    print(f"seed {seed}, level {level}, {way}: {error}", file=sys.stderr)
                except Exception as error:
                    failed.append(f"{seed}: {type(error).__name__}: {error}")
            least, most = np.min(rows, axis=0), np.max(rows, axis=0)
            numbers = ",".join(f"{value:.3g}" for value in least[:4])
            seconds = (process_time() - begin) / given.count
            print(
                f"{level},{way},{given.count},{refused},{len(failed)},{numbers},{most[4]:.0f},{seconds:.3f}", flush=True
            )
            for each in failed:
                print(f"failed: {each}", file=sys.stderr)
            bad += len(failed)
    sys.exit(bad > 0)


def cut_in(body, level, cuts, way):
    """Return a cut level, and the share of its volume that is lost though nothing was to be removed."""
    mesh = body.levels[level]
    if way == CONFORM:
        ends = mesh.nodes[mesh.edges]
        edge = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max())
        found = cut_body(body, cuts[0] if len(cuts) == 1 else Cuts(tuple(cuts)), edge, level=level)
        return found, abs(1.0 - found.coarse.volumes.sum() / mesh.volumes.sum())
    parted = part(body, level, cuts, way)
    return parted.body, 0.0 if way == REMOVAL else abs(parted.lost_share)


def worst(body, before):
    """Return least volume [m³], quality, dihedral angle [°] and pivot over the one ``before``, and how many pieces."""
    mesh = body.coarse
    pieces = components(mesh.edges, len(mesh.nodes)).max() + 1
    quality, angle = qualities(mesh.nodes[mesh.tetrahedra]).min(), dihedral_angles(mesh).min()
    return mesh.volumes.min(), quality, angle, smallest_pivot(body) / before, pieces


if __name__ == "__main__":
    main()
