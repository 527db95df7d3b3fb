"""Places in which a coarse mesh has to be finer than elsewhere, to show the regions of a body."""

import numpy as np


def balls_of(entry: dict) -> list[tuple[np.ndarray, float]]:
    """List centre (3,) [m] and radius [m] of the balls in which elements have to be small, for a body's config entry.

    They are the spheres of its regions, and of labels of a CT's mask balls of the same volume and middle.
    """
    balls = []
    for rule in (entry.get("regions") or {}).values():
        if "sphere" in rule:
            balls.append((np.array(rule["sphere"]["center_m"], dtype=float), float(rule["sphere"]["radius_m"])))
        elif "label" in rule and entry["kind"] == "ct":
            from palpate.bodies.ct.label_region import label_ball

            balls.append(label_ball(entry, rule["label"]))
    return balls
