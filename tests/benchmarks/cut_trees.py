"""Time the tree over the surface of the liver that a blade has cut: made for the new triangles, and fitted to motions.

    python tests/benchmarks/cut_trees.py

A cut changes the triangles, so that its tree is made anew; opening and closing the lips only moves them. Pairs of the
fitted tree, of one built where the lips are now, and of sorted boxes without a tree have to be the same; the exit code
is 1 if they are not.
"""

import sys
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from fixtures.bodies import LIVER

from palpate.bodies.cutting.cut import make_cut
from palpate.bodies.cutting.ways import SPLIT_FACES, part
from palpate.bodies.make_body import make_body
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import crossing_pairs
from palpate.studies.brute_force import crossing

CUT = {"path_m": [[0.03, -0.03, 0.06], [0.04, 0.0, 0.06], [0.05, 0.03, 0.06]], "depth_m": 0.03, "direction": [0, 0, -1]}
OPEN_M = 0.002
STATES = {"just cut": 0.0, "opened": 1.0, "pressed": -1.0, "opened again": 0.5}
REPEATS = 20


def main() -> None:
    """Print a row for each level and state of the lips."""
    body, wrong = make_body("liver", LIVER), 0
    knife = make_cut("cut", CUT, body.fine)
    print("level,triangles,new_triangles,state,pairs,quality,make_ms,refit_ms,search_ms,search_anew_ms,boxes_ms")
    for level, whole in enumerate(body.levels):
        parted = part(body, level, [knife], SPLIT_FACES)
        mesh, triangles = parted.mesh, parted.mesh.triangles
        opening = np.zeros_like(mesh.nodes)
        copied = np.bincount(parted.origin)[parted.origin] > 1
        for side in (1, -1):
            lip = np.unique(mesh.tetrahedra[parted.sides[:, 0] == side])
            lip = lip[copied[lip]]
            opening[lip] = side * OPEN_M * knife.pieces[0].normal
        tree = Tree(mesh.nodes, triangles)
        for state, share in STATES.items():
            x = mesh.nodes + share * opening
            made, make = timed(Tree, x, triangles)
            _, refit = timed(tree.refit, x)
            (pairs, _), search = timed(crossing_pairs, tree)
            (anew, _), search_anew = timed(crossing_pairs, made)
            right, boxes = timed(crossing, [x], [triangles])
            same = np.array_equal(pairs, right) and np.array_equal(anew, right)
            wrong += not same
            times = ",".join(f"{1e3 * each:.2f}" for each in (make, refit, search, search_anew, boxes))
            new = len(triangles) - len(whole.triangles)
            print(f"{level},{len(triangles)},{new},{state},{len(right)},{tree.quality:.2f},{times}")
    sys.exit(f"{wrong} searches are wrong" if wrong else 0)


def timed(do, *arguments):
    """Return what ``do`` returns, and the least time [s] of some calls."""
    times = []
    for _ in range(REPEATS):
        begin = process_time()
        found = do(*arguments)
        times.append(process_time() - begin)
    return found, min(times)


if __name__ == "__main__":
    main()
