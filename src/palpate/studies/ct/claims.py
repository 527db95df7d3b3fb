"""Judge claims on imaging (paper 3, chapter 2) and on masses from CT (paper 2)."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np
import pandas as pd

from palpate.report.claims import Claim, claims, verdict
from palpate.report.words import spaced
from palpate.studies.ct.imaging import BETWEEN, CORNERS, GRADIENT, TRIANGLES
from palpate.studies.ct.ray_casting import FRONT, SOLID, TRANSLUCENT, back_and_early

_SAME = 1e-6  # two pictures are the same if no colour differs by more than this
_GOOD = 0.95  # Dice coefficient from which on a mask counts as the same; two people who draw one differ by as much
_SUPPOSED = 5  # slices apart that masks are drawn; the thesis gives no number
_FASTER = 0.9  # share of the samples from which on downwards a picture is faster: less is lost in the noise
_SCAN = "synthetic abdomen, CT"


@claims("mask_interpolation", "surface_normals", "tissue_classes", "segmented_scans", "compositing")
def imaging(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims on imaging, which is chapter 2 of paper 3."""
    yield from _compositing(tables["compositing"])
    yield _masks(tables["mask_interpolation"])
    yield from _surface(tables["surface_normals"])
    yield _classes(tables["tissue_classes"])
    yield _mri(tables["segmented_scans"])


def _compositing(table: pd.DataFrame) -> Iterator[Claim]:
    """Judge whether both orders of compositing give one picture, and whether ending rays early is faster."""
    section, uncut_rays = "2, volume rendering", table[(table["order"] == FRONT) & (table["enough"] == 1)]
    claim = "compositing back to front and front to back give one picture"
    ours = f"colours within {uncut_rays['difference'].max():.1g}"
    yield Claim(3, section, claim, _SCAN, "the same", ours, verdict(uncut_rays["difference"].max() <= _SAME))
    claim = "front to back with rays that end early is faster"
    for looks in (TRANSLUCENT, SOLID):
        back_first, ends_early = back_and_early(table, looks)
        share, time = ends_early["samples"] / back_first["samples"], ends_early["median_s"] / back_first["median_s"]
        ours = f"{100 * share:.0f} % of the samples, {100 * time:.0f} % of the time, "
        ours += f"colours within {100 * ends_early['difference']:.2g} %"
        premise = f"{_SCAN}, {looks} tissues, rays end at opacity {ends_early['enough']:g}"
        yield Claim(3, section, claim, premise, "faster", ours, verdict(share <= _FASTER and time < 1))


def _masks(table: pd.DataFrame) -> Claim:
    interpolated = table[table["method"] == BETWEEN]
    n = min(interpolated["every"], key=lambda every: (abs(every - _SUPPOSED), every))
    rows = interpolated[interpolated["every"] == n]
    ours = f"Dice ≥ {rows['dice'].min():.3f}, volume within {100 * rows['volume_deviation'].abs().max():.2g} %"
    premise = f"{', '.join(rows['body'])}, every {n}th slice, no number in the paper"
    claim = "an organ that is drawn on every n-th slice can be interpolated between"
    return Claim(3, "2, segmentation", claim, premise, "it can", ours, verdict(rows["dice"].min() >= _GOOD))


def _surface(table: pd.DataFrame) -> Iterator[Claim]:
    """Judge normals from grey values against those of triangles, without and with blurred noise."""
    claim = "central differences of the grey values give better normals than triangles"
    for blur, noise in ((0, "noise as it is"), (1, "noise blurred by a voxel")):
        angles = table[table["blur_voxels"] == blur].set_index("normals_from")["median_deg"]
        ours = ", ".join(f"{angles[name]:.2g}° {name}" for name in (GRADIENT, CORNERS, TRIANGLES))
        premise = f"{_SCAN}, liver against its exact normals (medians), {noise}"
        holds = bool(angles[GRADIENT] < angles.drop(GRADIENT).min())
        yield Claim(3, "2, surface rendering", claim, premise, "smooth shading", ours, verdict(holds))


def _classes(table: pd.DataFrame) -> Claim:
    wrong = table.groupby("method")["rms_error"].mean()
    ours = ", ".join(f"{name}: shares of tissues wrong by {error:.2g}" for name, error in wrong.items())
    claim = "grey values are classified by threshold or by probability"
    return Claim(3, "2, volume rendering", claim, _SCAN, "either", ours, verdict(bool(wrong.max() < 0.2)))


def _mri(table: pd.DataFrame) -> Claim:
    dice = table.set_index("scan")["dice"]
    ours = f"Dice {dice['MRI, evened']:.3f} (CT {dice['CT']:.3f}; MRI as it is {dice['MRI']:.3f})"
    premise = "synthetic abdomen, T1, brightness uneven and evened by N4, one range of grey values"
    claim = "organs are segmented from CT or MRI"
    return Claim(3, "2, acquisition", claim, premise, "either", ours, verdict(bool(dice["MRI, evened"] >= _GOOD)))


# the body of the shipped settings whose CT is made up, and what a real one gave (docs/papers.md)
SYNTHETIC, MADE_UP = "abdomen", "synthetic: masses of meshes of a real liver differed by 10 %"
SPREAD, ELEMENTS, GOOD = 0.035, 6000, 0.01
"""The largest difference between meshes that the paper reports, the elements from which on it calls masses good, and
what good is taken to be: a deviation from the voxels."""


@claims("node_mass")
def node_masses(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims on masses, each over all bodies from a CT, with densities as in the paper."""
    table = tables["node_mass"].sort_values("elements")
    bodies = dict(list(table.groupby("body", sort=False)))
    low, high = table["elements"].min(), table["elements"].max()
    names = ", ".join(spaced(name) for name in bodies)
    note = f" ({MADE_UP})" if set(bodies) == {SYNTHETIC} else ""
    meshes = f"{names}{note}: meshes of {low} to {high} elements, with the volume of the voxels"
    premise = f"{meshes}; densities as they are at the rim"
    raw = {name: rows["raw_deviation"].to_numpy() + 1.0 for name, rows in bodies.items()}
    yield _claim("1, equation 4", "the total mass rises slightly with the number of elements", premise, "it rises",
                 raw, lambda mass: mass[-1] / mass[0] - 1.0, lambda rise: 0.0 < rise < 2.0 * SPREAD)  # fmt: skip
    yield _claim("2, table 1", "the total masses of meshes differ by at most", premise, "3.5 %",
                 raw, lambda mass: np.ptp(mass) / mass[-1], lambda spread: spread <= SPREAD)  # fmt: skip
    density = {name: rows["mean_density_kg_m3"].to_numpy() for name, rows in bodies.items()}
    organ = f"{meshes}; densities of the organ only"
    yield _claim("2, table 1", "the mean density hardly changes with the mesh", organ, "hardly",
                 density, lambda mean: np.ptp(mean) / mean[-1], lambda spread: spread <= GOOD)  # fmt: skip
    fine = {name: rows.loc[rows["elements"] >= ELEMENTS, "deviation_from_voxels"] for name, rows in bodies.items()}
    if all(len(rows) for rows in fine.values()):
        yield _claim("2, table 1", f"masses are good from {ELEMENTS} elements on", organ, f"{ELEMENTS} elements",
                     fine, lambda off: np.abs(off).max(), lambda most: most <= GOOD)  # fmt: skip


def _claim(
    section: str,
    claim: str,
    premise: str,
    published: str,
    values: Mapping[str, pd.Series],
    measure: Callable[[pd.Series], float],
    holds: Callable[[float], bool],
) -> Claim:
    """Judge a claim by ``holds(measure(values))`` of every body."""
    measured = {name: float(measure(each)) for name, each in values.items()}
    ours = ", ".join(f"{name.replace('_', ' ')} {100 * share:.2g} %" for name, share in measured.items())
    return Claim(2, section, claim, premise, published, ours, verdict(all(map(holds, measured.values()))))
