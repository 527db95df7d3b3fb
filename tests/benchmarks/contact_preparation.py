"""Time what contacts of the shipped liver take to be prepared, part by part, and how far their answers then are.

    python tests/benchmarks/contact_preparation.py [CONTACTS]

CONTACTS (default 4) are spread over the surface. Times are of one core, beside that of a linear response.
"""

import sys
from time import process_time

import numpy as np
from fused_kernel import shipped_liver

from palpate.bodies.contacts import kept_contacts
from palpate.models.contact_workshop import Workshop
from palpate.reduction.contact_snapshots import basis_of, thinned_model

RADIUS_M, NODES = 0.012, 12000


def main() -> None:
    body = shipped_liver(2)
    shop = Workshop(body, RADIUS_M, NODES)
    first, *nodes = kept_contacts(body, 1 + int(sys.argv[1]) if sys.argv[1:] else 5).tolist()
    prepare(shop, first)  # compiles
    found = np.array([prepare(shop, node) for node in nodes])
    once = shop.elements(shop.level)
    begin = process_time()
    once.solve(once.nodal(*shop.disc(nodes[0], shop.level), np.eye(3)[:, :1]), 1e-8)
    unit = process_time() - begin
    print("part,seconds,linear_responses")
    for part, seconds in zip(("pressed", "reduced", "level_before"), np.median(found[:, :3], axis=0), strict=True):
        print(f"{part},{seconds:.3f},{seconds / unit:.1f}")
    total = float(np.median(found[:, :3].sum(axis=1)))
    print(f"all,{total:.3f},{total / unit:.1f}\ndistance of snapshots over their size,{np.median(found[:, 3]):.1e}")


def prepare(shop: Workshop, node: int) -> tuple[float, float, float, float]:
    """Return the times [s] of a contact's parts, and the median distance of its reduced model from them."""
    times = [process_time()]
    shown = shop.snapshots(node)
    times.append(process_time())
    modes = basis_of([shown], True)
    model = thinned_model([shown], modes, 50, 0.003, 0)
    times.append(process_time())
    shop.before(node)
    times.append(process_time())
    apart = [
        np.linalg.norm(modes @ model.settle(force, 1e-4).q - shown.answers[:, :, k])
        / np.linalg.norm(shown.answers[:, :, k])
        for k, force in enumerate(shown.forces)
    ]
    pressed, reduced, before = np.diff(times)
    return float(pressed), float(reduced), float(before), float(np.median(apart))


if __name__ == "__main__":
    main()
