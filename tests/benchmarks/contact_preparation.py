"""Time what contacts of the shipped liver take to be prepared, part by part, and how far their answers then are.

    python tests/benchmarks/contact_preparation.py [CONTACTS]

CONTACTS (default 4) are spread over the surface. Times are of one core, beside that of a linear response. A contact of
columns alone is the first, second and third part, with the change from the level before.
"""

import sys
from collections.abc import Callable
from time import process_time

import numpy as np
from fused_kernel import shipped_liver
from threadpoolctl import threadpool_limits

from palpate.bodies.contacts import kept_contacts
from palpate.models.contact_modes.snapshots import basis_of, thinned_model
from palpate.models.contact_modes.workshop import Workshop, bearing

RADIUS_M, NODES = 0.012, 12000
PARTS = ["columns", "columns_thinned", "columns_borne", "columns_from_coarser"]
MORE = ["snapshots", "snapshots_thinned", "snapshots_from_coarser", "to_finer"]


def main() -> None:
    body = shipped_liver(2)
    shop = Workshop(body, RADIUS_M, NODES)
    for level in range(3):
        shop.elements(level), shop.up(level)
    first, *nodes = kept_contacts(body, 1 + int(sys.argv[1]) if sys.argv[1:] else 5).tolist()
    prepare(shop, first)  # compiles
    found = np.array([prepare(shop, node) for node in nodes])
    once = shop.elements(shop.level)
    begin = process_time()
    once.solve(once.nodal(*shop.disc(nodes[0], shop.level), np.eye(3)[:, :1]), 1e-8)
    unit = process_time() - begin
    print("part,seconds,linear_responses")
    for part, seconds in zip(PARTS + MORE, np.median(found[:, :-1], axis=0), strict=True):
        print(f"{part},{seconds:.3f},{seconds / unit:.1f}")
    bare = np.median(found[:, : len(PARTS)].sum(axis=1))
    pressed = np.median(found[:, [0, 2, *range(len(PARTS), len(PARTS) + 3)]].sum(axis=1))
    print(f"all with columns,{bare:.3f},{bare / unit:.1f}\nall with snapshots,{pressed:.3f},{pressed / unit:.1f}")
    print(f"distance of snapshots over their size,{np.median(found[:, -1]):.1e}")


def prepare(shop: Workshop, node: int) -> list[float]:
    """Return the times [s] of a contact's parts, and the median distance of its reduced model from its snapshots."""
    times = []

    def timed(make: Callable) -> object:
        begin = process_time()
        made = make()
        times.append(process_time() - begin)
        return made

    for modes in ("columns", "snapshots"):
        shown = timed(lambda modes=modes: shop.shown(node, modes))
        thin = timed(lambda shown=shown: thinned_model([shown], basis_of([shown]), 50, 0.003, 0))
        if modes == "columns":
            timed(lambda: bearing(shop, [node], "columns"))
        timed(lambda modes=modes: shop.from_coarser(node, modes))
    timed(lambda: shop.to_finer(node, 1.0))
    modes, answers = basis_of([shown]), np.moveaxis(shown.answers, 2, 0)
    apart = [
        np.linalg.norm(modes @ thin.settle(force, 1e-4).q - answer) / np.linalg.norm(answer)
        for force, answer in zip(shown.forces, answers, strict=True)
    ]
    return [*times, float(np.median(apart))]


if __name__ == "__main__":
    with threadpool_limits(limits=1):
        main()
