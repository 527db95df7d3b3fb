"""Numbers of the report on the steps from a scan to a picture and a mask."""

from collections.abc import Mapping

import pandas as pd

from palpate.report import tables
from palpate.report.number_format import percent
from palpate.studies.ct.imaging import BETWEEN, CORNERS, GRADIENT, NEAREST, TRIANGLES
from palpate.studies.ct.ray_casting import BACK, FRONT, SOLID, TRANSLUCENT


def numbers(read: Mapping[str, pd.DataFrame]) -> dict[str, str]:
    """Return the placeholders of the caption ``ct_imaging``, as text; a study's tables by name."""
    orders, scans = read["compositing"], read["segmented_scans"].set_index("scan")
    return {
        "order_difference": f"{tables.where(orders, order=FRONT, enough=1.0)['difference'].max():.1g}",
        "early_rays": "; ".join(_early(orders, looks) for looks in (TRANSLUCENT, SOLID)),
        "interpolated": _interpolated(read["mask_interpolation"]),
        "normal_angles": _angles(read["surface_normals"]),
        "wrong_voxels": _wrong(read["tissue_classes"]),
        "mri_dice": f"{scans['dice']['MRI']:.3f}",
        "evened_dice": f"{scans['dice']['MRI, evened']:.3f}",
        "ct_dice": f"{scans['dice']['CT']:.3f}",
    }


def _one(table: pd.DataFrame, **wanted) -> pd.Series:
    return tables.where(table, **wanted).iloc[0]


def _early(orders: pd.DataFrame, looks: str) -> str:
    """Describe what it saves and changes to end rays at 99 % opacity, or at the nearest to it."""
    orders = tables.where(orders, looks=looks)
    back = _one(orders, order=BACK)
    row = orders[(orders["order"] == FRONT) & (orders["enough"] < 1)].sort_values("enough").iloc[0]
    return (
        f"if tissues are {looks}, rays that end at an opacity of {row['enough']:g} take "
        f"{percent(row['samples'] / back['samples'])} of the samples, the picture is made in "
        f"{percent(row['median_s'] / back['median_s'])} of the time, and colours are within "
        f"{percent(row['difference'])}"
    )


def _interpolated(masks: pd.DataFrame) -> str:
    """Describe how far masks come back, for the distance of drawn slices nearest to 5."""
    n = min(masks["every"], key=lambda every: (abs(every - 5), every))
    between, nearest = (tables.where(masks, every=n, method=method)["dice"].min() for method in (BETWEEN, NEAREST))
    return f"from every {n}th slice with a Dice coefficient of {between:.3f} ({nearest:.3f} by the nearest drawn slice)"


def _angles(normals: pd.DataFrame) -> str:
    sharp = tables.where(normals, blur_voxels=0.0)
    found = {name: _one(sharp, normals_from=name)["median_deg"] for name in (GRADIENT, CORNERS, TRIANGLES)}
    return (
        f"{found[GRADIENT]:.2g}° from the gradient, {found[CORNERS]:.2g}° from the triangles around a point and "
        f"{found[TRIANGLES]:.2g}° of single triangles"
    )


def _wrong(classes: pd.DataFrame) -> str:
    means = classes.groupby("method", sort=False)["wrong"].mean()
    errors = classes.groupby("method", sort=False)["rms_error"].mean()
    return "; ".join(f"{name}: {percent(means[name])}, shares wrong by {errors[name]:.2g}" for name in means.index)
