"""Find the truth of presses on organs as found, with defaults of ``palpate try``, and tabulate how well it is known.

    python tests/benchmarks/organ_truths.py FOLDER [contacts] [nailed]

FOLDER has surfaces (.stl, .obj, .ply, in mm) or CTs beside a mask (NAME.nii.gz and NAME_mask.nii.gz); ``nailed`` holds
the nodes of the lowest tenth in place of the bed. Prints a row an organ: surface nodes and tetrahedra of the coarse
mesh, distance and volume against the data, the finest level of the truth and its elements, ratios, the truth's own
error (mean and greatest, of the peak), samples believed, and reasons for the others. The exit code is 1 if an organ has
no truth.
"""

import os
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter

from palpate.run.job import kernel_cache

os.environ["NUMBA_CACHE_DIR"] = str(kernel_cache())  # read when numba is imported

import numpy as np

from palpate.benchmark.presses import choose_presses
from palpate.benchmark.truth import OWN, Truth, reasons, truth_of
from palpate.bodies.body import Body
from palpate.bodies.make_body import make_body
from palpate.init.choose import Choice, choose
from palpate.init.recognise import Data, recognise

MM = 1e-3
HEAD = f"{'organ':16} {'nodes':>5} {'tets':>6} {'away':>6} {'volume':>7} {'level':>5} {'elements':>8} {'ratio':>11} "
HEAD += f"{'own':>7} {'most':>7} {'believed':>8} {'seconds':>7}"


def organs(folder: Path) -> Iterator[Data]:
    """Yield what ``palpate try`` would read of each organ in a folder."""
    for path in sorted(folder.iterdir()):
        if path.suffix in (".stl", ".obj", ".ply"):
            yield recognise([path], [], None, scale_m=MM)
        elif path.name.endswith("_mask.nii.gz"):
            yield recognise([path.with_name(path.name.replace("_mask", "")), path], [], None)


def tried(data: Data, contacts: int, nailed: bool) -> tuple[Choice, Body, Truth]:
    """Return what is chosen for an organ, the body that is tried, and the truth of its presses."""
    choice = choose(data.name, data.entry)
    held = {"bed": None, "anchors": {"plane": {"axis": "z", "side": "min", "depth_m": 0.1 * choice.coarse.size}}}
    body = make_body(data.name, choice.entry.but(refinements=1, **(held if nailed else {})))
    regime = choice.regimes["large"]
    presses = [{"magnitude": 1.0, "tilt_degrees": 0}, {"magnitude": 0.8, "tilt_degrees": 45}]
    loads = choose_presses(body, contacts, presses, regime, regime["radius_m"], seed=1)
    return choice, body, truth_of(body, loads.assign(sample=np.arange(len(loads))), ())


def row(data: Data, contacts: int, nailed: bool) -> tuple[str, int]:
    """Return the row of an organ, and how many of its samples are believed."""
    begin = perf_counter()
    choice, body, truth = tried(data, contacts, nailed)
    own, like = truth.own[truth.believed, OWN.index("rmse_of_peak")], choice.likeness
    known = f"{np.mean(own):7.3%} {own.max():7.3%}" if len(own) else f"{'-':>7} {'-':>7}"
    away = f"{like.away:6.2%} {like.volume:+7.2%}" if like else f"{0:6.2%} {0:+7.2%}"
    ratios = f"{np.nanmin(truth.ratio):5.2f}-{np.nanmax(truth.ratio):5.2f}" if np.isfinite(truth.ratio).any() else "-"
    found = f"{data.name:16} {len(body.coarse.surface):5} {len(body.coarse.tetrahedra):6} {away} {truth.level:5} "
    found += f"{truth.elements:8} {ratios:>11} {known} {truth.believed.sum():4}/{len(truth.sample):<3} "
    found += f"{perf_counter() - begin:7.0f}"
    why = "; ".join(f"{count} {reason}" for reason, count in reasons(truth.rejected).items())
    return f"{found}  {why}", int(truth.believed.sum())


def main() -> None:
    folder, contacts = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 6
    print(HEAD, flush=True)
    without = 0
    for data in organs(folder):
        with warnings.catch_warnings(action="ignore"):
            text, believed = row(data, contacts, "nailed" in sys.argv)
        print(text, flush=True)
        without += believed == 0
    sys.exit(int(without > 0))


if __name__ == "__main__":
    main()
