"""Settings of paper 1's enrichment."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from palpate.benchmark.settings import Regression
from palpate.bodies.settings import Anchors, Bed, Body, Magnitudes, Refinements
from palpate.errors import InputError, describe_unknown
from palpate.setting_types import Block, Count, Distinct, Inside, Name, Positive, Vector, Whole, key, optional
from palpate.studies.enrichment.premise_samples import sample_counts


class Case(Block):
    body: str = key("Name of a body")
    made_of: Literal["solid", "triangles", "springs"] = key(
        "Whether the body is solid, or its surface only, as elastic triangles or as springs along their edges", "solid"
    )
    direction: Vector | None = key("Direction of all presses, on the side that faces it; null: inward normals", None)
    anchors: Anchors | None = optional("Which coarse nodes are held, in place of the body's")
    bed: Bed | None = optional("An elastic bed, in place of the body's")
    refinements: Refinements | None = optional("How often each tetrahedron is split into eight, in place of the body's")
    magnitudes: Magnitudes | None = optional("Forces at each contact, in place of the body's")
    train: Whole | None = optional("Samples that are trained on, in place of the body's", ge=2)
    test: Count | None = optional("Samples that are held out, in place of the body's")


class Premises(Block):
    splits: Whole = key("Splits of each premise into training and test samples; each presses other contacts", 3, ge=2)
    training_shares: Distinct[Inside] = key(
        "Shares of the training contacts with which errors are measured", [0.35, 0.65]
    )
    peak_of_size: Positive = key("Displacement under magnitude 1, as a share of the body's longest side", 0.02, le=0.5)
    cases: dict[Name, Case] = key("The premises, by name; another name than any body with samples", {})


class Regime(Block):
    peak_of_size: Positive = key("Largest displacement, as a share of the body's longest side", le=0.5)


class Settings(Regression):
    """Paper 1's regressors."""

    complexity_samples: Distinct[Annotated[Whole, Field(ge=2)]] = key(
        "Numbers of training samples over which the growth of cost is measured", [25, 50, 100, 200], min_length=2
    )
    premises: Premises = key(
        "Bodies held so that they deform locally, as paper 1 assumes, or as a whole: contact-ordered features beside "
        "unordered ones in each, with linear responses",
        {},
    )
    regimes: dict[Name, Regime] = key(
        "How hard bodies are pressed by a force on a single node, as in the paper, by name; another name than any of "
        "the trade-off's",
        {"point_small": {"peak_of_size": 0.02}, "point_large": {"peak_of_size": 0.15}},
        min_length=1,
    )


def check(config: Any, file: Path) -> None:
    """Raise InputError for an empty range of widths, nothing to sample."""
    settings, place = config.enrichment, f"{file}: enrichment"
    low, high = settings.sigma_relative.min, settings.sigma_relative.max
    if low >= high:
        raise InputError(f"{place}.sigma_relative.min is {low}; make it less than max, {high}.")
    if not any(getattr(body, "train", None) for body in config.bodies.values()):
        raise InputError(f"{place} is there and no body has train and test; give a body both.")
    for name, case in settings.premises.cases.items():
        _check_premise(f"{place}.premises.cases.{name}", name, case, config.bodies)
    if twice := sorted(set(settings.regimes) & set(config.regimes or {})):
        raise InputError(f"{place}.regimes.{twice[0]} is under regimes, too; give it another name.")


def _check_premise(place: str, name: str, case: Case, bodies: Mapping[str, Body]) -> None:
    """Raise InputError for a premise without a body that is refined, or without whole contacts to hold out."""
    if wrong := describe_unknown([case.body], list(bodies)):
        raise InputError(f"{place}.body names {wrong}")
    body = bodies[case.body]
    if case.direction is not None and not any(case.direction):
        raise InputError(f"{place}.direction is [0, 0, 0], which points nowhere; give one number that is not 0.")
    if getattr(bodies.get(name), "train", None):
        raise InputError(f"{place} has the name of a body with samples, which is a premise, too; give it another.")
    if not (case.refinements or getattr(body, "refinements", 0)):
        raise InputError(f"{place}.body names {case.body}, which is not refined; give refinements of at least 1.")
    sample_counts(place, case, body)
