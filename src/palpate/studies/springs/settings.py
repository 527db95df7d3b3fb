"""Settings of paper 2's springs."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from palpate.errors import InputError
from palpate.setting_types import Block, Count, NotNegative, Pair, Positive, Some, Vector, Whole, key

SIDES, HEIGHTS = (0, 0.005, 0.01), (0.0025, 0.005, 0.01)


class Material(Block):
    young_pa: Positive = key("Young's modulus [Pa]", 1000)
    poisson: NotNegative = key("Poisson's ratio", 0.3, lt=0.5)
    density_kg_m3: Positive = key("Density [kg/m³]", 1000)


class Searches(Block):
    seeds: Count = key("Runs of each search that draws lots", 3)
    population: Whole = key("Individuals of the genetic algorithm", 30, ge=4)
    generations: Count = key("Generations of the genetic algorithm", 1000)
    cma_es_evaluations: Count = key("Motions that CMA-ES may compute", 6000)
    gradient_evaluations: Count = key("Motions and adjoints that the gradient's descent may compute", 300)


class Floor(Block):
    poissons: Some[Annotated[NotNegative, Field(le=0.49)]] = key(
        "Poisson's ratios of the references", [0.1, 0.2, 0.25, 0.3, 0.4, 0.45, 0.49]
    )
    evaluations: Count = key("Motions and adjoints of each fit", 40)


class Settings(Block):
    """Paper 2's experiment: a spring network fitted to finite elements."""

    side_m: Positive = key("Side of the cube [m]", 0.01)
    material: Material = key("What the reference is made of", {})
    force_n: Positive = key("Force on the middle of a face [N]", 0.001)
    rise_s: Positive = key("Time in which the force grows [s]", 0.02)
    duration_s: Positive = key("Simulated time [s]", 0.08)
    step_s: Positive = key("Time step of the springs [s]", 0.00032)
    substeps: Count = key("Steps of the reference in each step of the springs", 2)
    damping_ratio: NotNegative = key("Damping of each spring, relative to critical damping of its two nodes", 0.1)
    key_points_m: list[Vector] = key(
        "Where motions are compared, in a cube from the origin [m]",
        [[x, y, z] for z in HEIGHTS for x in SIDES for y in SIDES],
        min_length=1,
    )
    young_pa: Pair[Positive] = key("Least and largest modulus that a search may give a node [Pa]", [300, 3000])
    searches: Searches = key("How long searches go on", {})
    floor: Floor = key("What springs can follow at all", {})


def check(config: Any, file: Path) -> None:
    """Raise InputError for what would else be found only when the springs are simulated."""
    place, settings = f"{file}: springs", config.springs
    low, high = settings.young_pa
    if low >= high:
        raise InputError(f"{place}.young_pa is [{low:g}, {high:g}]; give the lower number first.")
    if settings.duration_s < settings.step_s:
        raise InputError(
            f"{place}.duration_s is {settings.duration_s:g}, and step_s {settings.step_s:g}; give the time of one step "
            "at least."
        )
    for number, point in enumerate(settings.key_points_m):
        if not all(0 <= coordinate <= settings.side_m for coordinate in point):
            raise InputError(
                f"{place}.key_points_m[{number}] is {point}, which is outside the cube; "
                f"give coordinates from 0 to side_m, {settings.side_m:g}."
            )
