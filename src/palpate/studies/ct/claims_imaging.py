"""Judge paper 3's claims of chapter 2: from a scan to a surface, a mask and a picture."""

from collections.abc import Iterator, Mapping

import pandas as pd

from palpate.report.claims import Claim, verdict
from palpate.studies.ct.imaging import BETWEEN, CORNERS, GRADIENT, TRIANGLES
from palpate.studies.ct.ray_casting import BACK, FRONT, SOLID, TRANSLUCENT

TABLES = ("mask_interpolation", "surface_normals", "tissue_classes", "segmented_scans", "compositing")

_SAME = 1e-6
"""Two pictures are the same if no colour differs by more than this."""
_GOOD = 0.95
"""Dice coefficient from which on a mask counts as the same; two people who draw one differ by as much."""
_SUPPOSED = 5
"""Slices apart that masks are drawn; the thesis gives no number."""
_FASTER = 0.9
"""Share of the samples from which on downwards a picture is faster: less of a difference is lost in the noise."""
_SCAN = "synthetic abdomen, CT"


def claims(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims."""
    yield from _compositing(tables["compositing"])
    yield _masks(tables["mask_interpolation"])
    yield from _surface(tables["surface_normals"])
    yield _classes(tables["tissue_classes"])
    yield _mri(tables["segmented_scans"])


def _compositing(table: pd.DataFrame) -> Iterator[Claim]:
    section, whole = "2, volume rendering", table[(table["order"] == FRONT) & (table["enough"] == 1)]
    claim = "compositing back to front and front to back give one picture"
    ours = f"colours within {whole['difference'].max():.1g}"
    yield Claim(3, section, claim, _SCAN, "the same", ours, verdict(whole["difference"].max() <= _SAME))
    claim = "front to back with rays that end early is faster"
    for looks in (TRANSLUCENT, SOLID):
        rows = table[table["looks"] == looks]
        back = rows[rows["order"] == BACK].iloc[0]
        early = rows[(rows["order"] == FRONT) & (rows["enough"] < 1)].sort_values("enough").iloc[0]
        share, time = early["samples"] / back["samples"], early["median_s"] / back["median_s"]
        ours = f"{100 * share:.0f} % of the samples, {100 * time:.0f} % of the time, colours within " + (
            f"{100 * early['difference']:.2g} %"
        )
        premise = f"{_SCAN}, {looks} tissues, rays end at opacity {early['enough']:g}"
        yield Claim(3, section, claim, premise, "faster", ours, verdict(share <= _FASTER and time < 1))


def _masks(table: pd.DataFrame) -> Claim:
    between = table[table["method"] == BETWEEN]
    n = min(between["every"], key=lambda every: (abs(every - _SUPPOSED), every))
    rows = between[between["every"] == n]
    ours = f"Dice ≥ {rows['dice'].min():.3f}, volume within {100 * rows['volume_deviation'].abs().max():.2g} %"
    premise = f"{', '.join(rows['body'])}, every {n}th slice, no number in the paper"
    claim = "an organ that is drawn on every n-th slice can be interpolated between"
    return Claim(3, "2, segmentation", claim, premise, "it can", ours, verdict(rows["dice"].min() >= _GOOD))


def _surface(table: pd.DataFrame) -> Iterator[Claim]:
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
    found = table.set_index("scan")["dice"]
    ours = f"Dice {found['MRI, evened']:.3f} (CT {found['CT']:.3f}; MRI as it is {found['MRI']:.3f})"
    premise = "synthetic abdomen, T1, brightness uneven and evened by N4, one range of grey values"
    claim = "organs are segmented from CT or MRI"
    return Claim(3, "2, acquisition", claim, premise, "either", ours, verdict(bool(found["MRI, evened"] >= _GOOD)))
