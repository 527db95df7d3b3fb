"""Bodies as they might have been described: under another law, with another Poisson's ratio, or of one material."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from palpate.bodies.body import Body
from palpate.bodies.material import Material, Tissue
from palpate.studies.law.names import LAW, OWN, POISSON, REGIONS


@dataclass(frozen=True, eq=False)
class Variant:
    """A body, and what has been ``changed`` in it."""

    changed: str
    body: Body


def variants(body: Body, laws: Sequence[str], poissons: Sequence[float]) -> list[Variant]:
    """Return the body as it is described, then each with one thing changed.

    laws, poissons : those to try; where they are the body's own already, nothing is changed and there is no variant
    A body with regions is also tried without them, of its own material alone.
    """
    found = [Variant(OWN, body)]
    found += [Variant(LAW, _changed(body, law=law)) for law in laws if law != body.material.law]
    for poisson in poissons:
        if any(each.poisson != poisson for each in _materials(body)):
            found.append(Variant(POISSON, _changed(body, poisson=poisson)))
    if body.regions is not None:
        found.append(Variant(REGIONS, replace(body, regions=None)))
    return found


def _materials(body: Body) -> Sequence[Material]:
    return [body.material] if body.regions is None else [body.material, *body.regions.materials]


def _changed(body: Body, **change: Any) -> Body:
    """Return ``body`` with a field of every material changed; Young's moduli and densities stay."""
    regions = body.regions
    if regions is not None:
        regions = Tissue([replace(each, **change) for each in regions.materials], regions.region)
    return replace(body, material=replace(body.material, **change), regions=regions)
