"""Press balls into a liver at many places, and compare the forces that `palpate identify` computes there with a truth.

    python tests/benchmarks/organ_presses.py truth presses.npz     # an hour of a core
    python tests/benchmarks/organ_presses.py truth presses.npz 2   # the first two laws only, a quarter of it
    python tests/benchmarks/organ_presses.py judge presses.npz     # ten minutes
    python tests/benchmarks/organ_presses.py engine presses.npz    # MuJoCo, if installed

The truth: quadratic elements, refined at the touch to two sizes under the first law, and at the first FINEST places to
a third, from which the order of convergence is taken. Their limit (Richardson 1911) over the second size corrects that
under other laws, since the error of a mesh hardly depends on them. What elements at the rim of what is held miss is
linear in the force: it is found by linear elements of four sizes there. `own` is by what both limits have changed it.
"""

import json
import os
import sys
import tempfile
from pathlib import Path
from time import process_time

from palpate.bodies.settings import Liver
from palpate.run.job import kernel_cache

# read when numpy and numba are imported
os.environ |= {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
os.environ.setdefault("NUMBA_CACHE_DIR", str(kernel_cache()))
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from fixtures.exported_flex import forces_there
from scipy.interpolate import PchipInterpolator

from palpate.benchmark.touch import Touch, places_to_touch
from palpate.benchmark.touch_mesh import TouchedMeshes
from palpate.bodies.body import Body
from palpate.bodies.local_refinement import LocalRefinement
from palpate.bodies.make_body import make_body
from palpate.effects.instrument import Instrument
from palpate.effects.patch_load import Patch
from palpate.errors import NotConverged
from palpate.files import write_whole
from palpate.identification.export.numbers import Numbers
from palpate.identification.export.write import export
from palpate.identification.forward import SlabForward
from palpate.identification.on_body import MARGIN, OrganForward, far_compliance, touch_of
from palpate.identification.presses import Press

PLACES, SEED = 16, 5
RADII_M = (0.004, 0.008)
SHARES = (0.15, 0.3, 0.45, 0.6, 0.75)
"""Depths over the radius."""
CASES = (("neo_hookean", 0.3), ("neo_hookean", 0.45), ("exponential(8)", 0.45), ("corotational", 0.3))
HELD, ALONG, TOLERANCE = 1, 1.5, 1e-3
PRESSED, DEEP, FINE = 4, 0.6, 0.4
"""Places that an engine presses, how deep over the radius, and the length of local elements over it."""
FINEST, ALL_LAWS, STIFF = 1, 2, 2
"""How many places are pressed on the finest mesh, and under all laws; the law that all are pressed under coarsely."""
YOUNG = 3000.0


def liver(law: str, poisson: float) -> Body:
    """Return the liver of config.yaml with another tissue."""
    entry = Liver(
        length_m=0.2, refinements=2, young_pa=YOUNG, poisson=poisson, law=law, density_kg_m3=1000.0,
        anchors={"sphere": {"center_m": [-0.03, 0.05, 0.03], "radius_m": 0.04}},
    )  # fmt: skip
    return make_body("liver", entry)


def curve(body: Body, radius: float, node: int, coarser: int) -> np.ndarray:
    """Return the forces (k,) [N] for Young's modulus 1 Pa on a mesh so many levels coarser; NaN where there is none."""
    direction = -body.fine.normals[node]
    touch = Touch(Instrument("sphere", radius), node, direction, SHARES[-1] * radius)
    meshes, forces = TouchedMeshes(body), np.full(len(SHARES), np.nan)
    try:
        mesh = meshes.around(touch, HELD, meshes.level_for(touch, ALONG) - coarser)
        for i, state in enumerate(mesh.contact.push(direction, [s * radius for s in SHARES], TOLERANCE)):
            forces[i] = float(state.force @ direction) / YOUNG
    except NotConverged as failure:
        print("  no answer:", failure)
    return forces


def thickness(body: Body, node: int) -> float:
    """Return how far [m] the surface is behind a node, against its normal."""
    start, way = body.fine.nodes[node], -body.fine.normals[node]
    a, b, c = body.fine.nodes[body.fine.triangles].transpose(1, 0, 2)
    n = np.cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = ((a - start) * n).sum(1) / (n @ way)
    p = start + t[:, None] * way
    inside = np.all([(np.cross(v - u, p - u) * n).sum(1) >= 0 for u, v in ((a, b), (b, c), (c, a))], axis=0)
    return float(t[inside & (t > 1e-4)].min(initial=np.inf))


def missed(body: Body, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what a body of 1 Pa gives way more than on HELD at each node (k,) [m/N], and what of it is a limit's."""
    meshes = TouchedMeshes(body)
    patches = [Patch(body.fine.nodes[node], body.fine.normals[node], 0.012) for node in nodes]
    rims = [far_compliance(*meshes.at_rim(held), patches) for held in (1, 2, 3)]
    first, last = rims[1] - rims[0], rims[2] - rims[1]
    more = last / (np.clip(first / last, 2.0, 3.0) - 1.0)
    return rims[2] + more - rims[0], np.abs(more)


def farther(force: np.ndarray, depth: np.ndarray, more: float) -> np.ndarray:
    """Return forces (k,) [N] at the same depths (k,) [m] of what gives way ``more`` [m/N]."""
    if np.isnan(force).any():
        return force
    there = PchipInterpolator(np.append(0.0, depth + more * force), np.append(0.0, force) ** (2 / 3))
    return there(depth) ** 1.5


def truth(path: Path, laws: str = str(len(CASES))) -> None:
    """Compute the forces of all places under the first ``laws`` and save what there is after each curve."""
    everywhere = ALL_LAWS if int(laws) == len(CASES) else 0
    bodies = [liver(*case) for case in CASES]
    body, able = bodies[0], places_to_touch(bodies[0])
    # by area, as random presses are
    order = np.argsort(np.random.default_rng(SEED).exponential(size=len(able)) / body.fine.areas[able])
    nodes = able[order[:PLACES]]
    depth = np.outer(RADII_M, SHARES)
    sizes = np.full((len(CASES) + 2, len(RADII_M), PLACES, len(SHARES)), np.nan)
    coarse = np.full(sizes.shape[1:], np.nan)
    if not path.exists():
        far, doubt = missed(body, nodes)
    else:  # go on with what there is
        before = np.load(path)
        sizes, far, doubt = before["sizes"], before["far_m_n"], before["doubt_m_n"]
        coarse = before["coarse"]
    for p, node in enumerate(nodes):
        for r, radius in enumerate(RADII_M):
            begin = process_time()
            # the first law on the coarse mesh, all laws on the usual one, and the first on the finest
            asked = [(bodies[0], 1), *((each, 0) for each in bodies), (bodies[0], -1)]
            for c, (each, coarser) in enumerate(asked):
                few = each in bodies[: int(laws)] if p < everywhere or int(laws) < len(CASES) else each is bodies[0]
                wanted = p < FINEST if coarser < 0 else few
                if wanted and np.isnan(sizes[c, r, p]).all():
                    sizes[c, r, p] = curve(each, radius, int(node), coarser)
            if int(laws) > STIFF and np.isnan(coarse[r, p]).all():
                coarse[r, p] = curve(bodies[STIFF], radius, int(node), 1)
            if p >= ALL_LAWS:  # the error of a mesh hardly depends on the law, as `coarse` shows at the first places
                sizes[1 + STIFF, r, p] = coarse[r, p] * sizes[1, r, p] / sizes[0, r, p]
            last, before = sizes[1] - sizes[0], sizes[-1] - sizes[1]
            rate = max(2.0, float(np.nanmedian(last / before)))
            more = last / (rate - 1.0)
            near = sizes[1:-1] * (1.0 + more / sizes[1])
            force = np.array(
                [
                    [[farther(near[c, i, j], depth[i], far[j]) for j in range(PLACES)] for i in range(len(RADII_M))]
                    for c in range(len(CASES))
                ]
            )
            off = np.array(
                [
                    [farther(near[0, i, j], depth[i], far[j] + doubt[j]) for j in range(PLACES)]
                    for i in range(len(RADII_M))
                ]
            )
            own = np.abs(more) / force[0] + np.abs(off / force[0] - 1.0)
            print(p, node, radius, np.round(force[:, r, p, -1] / radius**2, 4), np.round(own[r, p], 4),
                  f"rate {rate:.2f} {process_time() - begin:.0f} s", flush=True)  # fmt: skip
            with write_whole(path) as temporary, temporary.open("wb") as file:
                np.savez(
                    file, force=force, own=own, sizes=sizes, nodes=nodes, at_m=body.fine.nodes[nodes],
                    direction=-body.fine.normals[nodes], thickness_m=[thickness(body, int(n)) for n in nodes],
                    radii_m=RADII_M, depth_m=depth, far_m_n=far, doubt_m_n=doubt, coarse=coarse,
                    laws=[c[0] for c in CASES], poisson=[c[1] for c in CASES], young_pa=1.0,
                )  # fmt: skip


class Known:
    """The truth of one radius under the first law, as a forward model; linear in the depth to the power 1.5."""

    parameters, relative_error = (), 0.0

    def __init__(self, found: dict, radius: int):
        self._depth, self._force = found["depth_m"][radius], found["force"][0, radius]

    def forces(self, press: int, depth_m: np.ndarray, values: dict) -> np.ndarray:
        """Return forces (k,) [N] for young_pa = 1."""
        return np.interp(depth_m**1.5, self._depth**1.5, self._force[press])


def engine(path: Path) -> None:
    """Export the first law's numbers on two meshes, and press them in MuJoCo with the same ball."""
    found = dict(np.load(path))
    body = liver(*CASES[0])
    kept = np.flatnonzero(np.isfinite(found["force"][0]).all(axis=(0, 2)))[:PRESSED]
    numbers = Numbers("liver", YOUNG, CASES[0][1], 1000.0, CASES[0][0])
    for r, radius in enumerate(RADII_M):
        instrument = Instrument("sphere", radius)
        presses = [
            Press(
                str(p),
                "",
                "",
                "",
                found["at_m"][p],
                found["direction"][p],
                None,
                np.array([DEEP * radius]),
                np.zeros(1),
            )
            for p in kept
        ]
        places = found["at_m"][kept]
        touch = touch_of(body, instrument, presses[0], DEEP * radius)
        edge = TouchedMeshes(body).edge_m(touch, 0)
        depth = int(np.ceil(np.log2(edge / (FINE * radius))))
        radii = [1.5 * radius + 1.5 * edge / 2.0**i for i in range(depth)]
        local = LocalRefinement(body.up_to(0), depth).around(places, radii, 1)
        for name, mesh, level in (
            ("level 2", body, 2),
            (f"edges of {1e3 * edge / 2**depth:.2g} mm there", local, depth),
        ):
            organ, folder = Known({**found, "force": found["force"][:, :, kept]}, r), Path(tempfile.mkdtemp())
            export(numbers, mesh, level, instrument, presses, organ, {}, folder)
            facts = json.loads((folder / "exported.json").read_text())["engines"]
            begin = process_time()
            there, right = forces_there(folder, "liver")
            count = len(mesh.levels[level].nodes)
            print(f"{1e3 * radius:g} mm ball, {DEEP * radius * 1e3:g} mm deep, {name}, {count} nodes:")
            for each, said in facts.items():
                over = np.round(np.array(said["force_over_organ"], dtype=float), 3)
                print(f"  {each}: E = {said['young_pa']:.0f} Pa, {said['stiffer_by']:+.1%}, {over}")
            mean = np.exp(np.log(there / right).mean()) - 1.0
            print(f"  MuJoCo over the organ: {mean:+.1%}, {np.round(there / right, 3)}, {process_time() - begin:.0f} s")
            sys.stdout.flush()


def judge(path: Path) -> None:
    """Compare the forces of ``OrganForward`` with the truth, law by law and place by place."""
    found, errors = dict(np.load(path)), []
    for r, radius in enumerate(RADII_M):
        depth = found["depth_m"][r]
        kept = np.flatnonzero(np.isfinite(found["force"][0, r]).all(axis=1))
        presses = [
            Press(str(p), "", "", "", found["at_m"][p], found["direction"][p], None, depth, np.zeros(len(depth)))
            for p in kept
        ]
        for law in dict.fromkeys(kind.split("(")[0] for kind, _ in CASES):
            stiffening = (0.0, 16.0) if law == "exponential" else 0.0
            local = SlabForward(radius, MARGIN * depth[-1], law, None, (0.3, 0.45), stiffening)
            organ = OrganForward(liver("neo_hookean", 0.3), Instrument("sphere", radius), presses, local, law)
            for c, (case, poisson) in enumerate(CASES):
                if case.split("(")[0] != law:
                    continue
                values = {"poisson": poisson, "stiffening": 8.0}
                values = {each.name: values[each.name] for each in organ.parameters}
                for i, p in enumerate(kept):
                    errors.append(organ.forces(i, depth, values) / found["force"][c, r, p] - 1.0)
                    print(f"{1e3 * radius:g} mm, {case} {poisson}, place {p}: {np.round(errors[-1], 3)}", flush=True)
    print(f"mean {np.nanmean(errors, axis=0).round(4)}, deviation {np.nanstd(errors, axis=0).round(4)}, by depth")


if __name__ == "__main__":
    {"truth": truth, "judge": judge, "engine": engine}[sys.argv[1]](Path(sys.argv[2]), *sys.argv[3:])
