"""Report on bodies from CT and MRI: segmentation, pictures, mesh, the masses of its nodes, and the steps between."""

from typing import Any

import pandas as pd

from palpate.report import tables
from palpate.report.report import Report
from palpate.report.words import spaced
from palpate.studies.ct.claims import ELEMENTS
from palpate.studies.ct.imaging import BETWEEN, CORNERS, GRADIENT, NEAREST, TRIANGLES
from palpate.studies.ct.ray_casting import FRONT, SOLID, TRANSLUCENT, back_and_early
from palpate.table_declaration import Table

TITLE = "From CT to body"

MESH_QUALITY = Table(
    "mesh_quality",
    "The extreme angles, the worst shape and the volume of each level of a body's meshes.",
    """
    body level: a body, and a level of its meshes
    min_dihedral_deg max_dihedral_deg: extreme dihedral angles [°]
    min_radius_ratio volume_m3: worst ratio of radii of in- and circumsphere, and volume [m³]
    """,
)


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    report.check(("mesh_quality", "mask_interpolation"), "body", report.cts)
    found = report.tables
    return {
        "bodies": [_of_body(body, tables.where(found["mesh_quality"], body=body)) for body in report.cts],
        "masses": [_masses(rows) for _, rows in found["node_mass"].groupby("body", sort=False)]
        if "node_mass" in found
        else [],
        "enough_elements": ELEMENTS,
        **_imaging(found),
    }


def _of_body(body: str, quality: pd.DataFrame) -> dict[str, Any]:
    return {
        "key": body,
        "name": spaced(body),
        "volume_ml": 1e6 * quality.sort_values("level").iloc[0]["volume_m3"],
        "angle": quality["min_dihedral_deg"].min(),
        "quality": quality.drop(columns="body"),
    }


def _masses(rows: pd.DataFrame) -> dict[str, Any]:
    rows = rows.sort_values("elements")
    off, enough = rows["deviation_from_voxels"].abs(), rows["elements"] >= ELEMENTS
    return {
        "name": spaced(str(rows["body"].iloc[0])),
        "total_kg": (rows["total_mass_kg"].min(), rows["total_mass_kg"].max()),
        "off": off.max(),
        "off_fine": off[enough].max() if enough.any() else None,
        "raw": (rows["raw_deviation"].iloc[0], rows["raw_deviation"].iloc[-1]),
        "density": (rows["mean_density_kg_m3"].min(), rows["mean_density_kg_m3"].max()),
    }


def _imaging(found: dict[str, pd.DataFrame]) -> dict[str, Any]:
    orders, masks, classes = found["compositing"], found["mask_interpolation"], found["tissue_classes"]
    scans = found["segmented_scans"].set_index("scan")["dice"]
    sharp = tables.where(found["surface_normals"], blur_voxels=0.0).set_index("normals_from")["median_deg"]
    every = min(masks["every"], key=lambda n: (abs(n - 5), n))
    means = classes.groupby("method", sort=False)[["wrong", "rms_error"]].mean()
    return {
        "order_difference": tables.where(orders, order=FRONT, enough=1.0)["difference"].max(),
        "early": [_early(orders, looks) for looks in (TRANSLUCENT, SOLID)],
        "every": int(every),
        "dice": [tables.where(masks, every=every, method=method)["dice"].min() for method in (BETWEEN, NEAREST)],
        "angles": [sharp[source] for source in (GRADIENT, CORNERS, TRIANGLES)],
        "classes": list(means.itertuples()),
        "scans": [scans[name] for name in ("CT", "MRI", "MRI, evened")],
    }


def _early(orders: pd.DataFrame, looks: str) -> dict[str, Any]:
    back, early = back_and_early(orders, looks)
    shares = {name: early[name] / back[name] for name in ("samples", "median_s")}
    return {"looks": looks, "enough": early["enough"], "difference": early["difference"]} | shares
