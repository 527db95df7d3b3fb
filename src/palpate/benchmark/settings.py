"""Settings that studies of presses share: which bodies, how hard, by which instruments, and how they are relaxed."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from palpate.bodies.settings import Body, longest_m
from palpate.errors import InputError, describe_unknown
from palpate.setting_types import (
    Block,
    Count,
    Index,
    NotNegative,
    Positive,
    Share,
    Some,
    Switch,
    Vector,
    Whole,
    key,
    optional,
)  # fmt: skip

if TYPE_CHECKING:
    from palpate.effects.instrument import Instrument as RigidInstrument


class Disc(Block):
    radius_m: Positive = key("Radius [m] of the disc that is pressed; a fingertip has 0.012")
    radius_of_body_m: dict[str, Positive] = key("Other radii [m], by the names of bodies", {})

    def radius_on(self, body: str) -> float:
        """Return the radius [m] of the disc on a body."""
        return float(self.radius_of_body_m.get(body, self.radius_m))


class Regime(Disc):
    peak_of_size: Positive | None = optional(
        "Largest displacement that the forces are found for, as a share of the body's longest side; left out, "
        "pressure_of_young alone says how hard",
        le=0.5,
    )
    pressure_of_young: Share = key(
        "Highest pressure under a press, 2 F/(π R²), as a share of Young's modulus; beyond 0.15 to 0.3, by the place, "
        "tissue that obeys the corotational law collapses under a finger, and no mesh agrees with another",
        0.25,
    )


class Instrument(Block):
    kind: Literal["sphere", "capsule", "punch", "grasp"] = key(
        "A ball; a capsule, which lies on its side; a punch, a cylinder with a flat end; or a grasp, which holds a "
        "patch of the surface and pulls it"
    )
    radius_m: Positive = key("Radius [m], of a grasp that of the patch")
    edge_m: NotNegative = key("Radius [m] of a punch's rounded edge", 0.0)
    length_m: NotNegative = key("Length [m] of a capsule between the centres of its ends", 0.0)
    sticks: Switch = key("Whether what it touches keeps its place on it, or slides without friction", False)


class TouchTruthSettings(Block):
    along_radius: Positive = key("Least number of elements along the contact's radius on the finest mesh", 3.0)
    finest: Count = key("Level, from the first of the body's shape, that the rim of what is held is refined to", 3)
    most_force_error: Share = key("Own error of the force above which a touch judges no model, over the force", 0.03)
    most_error: Share = key("Own error over the surface above which a touch judges no model, over the peak", 0.01)


class Widths(Block):
    min: Positive = key("Smallest width", 0.01)
    max: Positive = key("Largest width", 100)
    count: Whole = key("Number of widths", 25, ge=2)


class Regression(Block):
    neighbours: Count = key("Coarse nodes in a contact-ordered feature (the paper's l)", 10)
    sigma_relative: Widths = key("Kernel widths tried, over the median distance of training features", {})
    folds: Whole = key("Parts of the cross-validation that chooses widths and ridges", 5, ge=2)


class FitOptions(Regression):
    split: Literal["samples", "contacts"] = key("Folds hold out what the split holds out", "contacts")
    seed: Whole = key("Seed of the folds, and of every other random choice of a model", 1)


LEVEL = "Level of the body; those that a body has not are left out"
"""What a setting that is tried says of its level."""


class OnLevel(Block):
    level: Index = key(LEVEL, 0)


class Xpbd(OnLevel):
    steps: Count = key("Steps; of a body under an instrument, at each of its five stops", 5)
    iterations: Count = key("Iterations of each step", 1)
    step: Positive = key(
        "Length of a step over √(mass / stiffness) of a node alone; longer ones settle beside the truth", 3.0
    )


class VertexBlockDescent(OnLevel):
    sweeps: Count = key("Sweeps over all nodes; of a body under an instrument, at each of its five stops", 10)
    radius: NotNegative = key(
        "Spectral radius of a sweep that Chebyshev's semi-iterative method assumes; 0 for none", 0.9995, lt=1
    )


class ProjectiveDynamics(OnLevel):
    iterations: Count = key("Iterations; of a body under an instrument, at each of its five stops", 5)
    memory: Index = key("Steps by which the matrix is improved (Liu, Bouaziz and Kavan, 2017); 0 for the original", 5)


class Given(Block):
    body: str = key("Body that is touched, by name")
    at_m: Vector = key("Point [m] whose nearest node of the surface is touched")
    direction: Vector | None = key(
        "Direction of the instrument's way; null is the inward normal, and of a grasp the outward one", None
    )
    depths_m: Some[Positive] = key("Depths [m] from first touch, each a touch of its own")


def instrument_name(tool: "Instrument | RigidInstrument") -> str:
    """Return what an instrument is called in names of scenes and folders: "sphere_8mm"."""
    return f"{tool.kind}_{1e3 * tool.radius_m:g}mm"


def pressed_bodies(config: Any, study: str = "tradeoff") -> list[str]:
    """Return the names of the bodies that a study presses: those that it names, or all that are refined."""
    asked = getattr(config, study)
    if asked is None:
        return []
    return asked.bodies or [name for name, body in config.bodies.items() if getattr(body, "refinements", 0)]


def check_refined(place: str, names: list[str], bodies: Mapping[str, Body]) -> None:
    """Raise InputError naming ``place`` for ``names`` of bodies that there are not, or that are not refined."""
    if wrong := describe_unknown(names, list(bodies)):
        raise InputError(f"{place} names {wrong}")
    for name in names:
        if not getattr(bodies[name], "refinements", 0):
            raise InputError(f"{place} names {name}, which is not refined; give it refinements of at least 1.")


def check_instruments(place: str, tools: list[Instrument], names: list[str], bodies: Mapping[str, Any]) -> None:
    """Raise InputError naming ``place`` for instruments with lengths they do not have, twice, or larger than a body.

    names : of the bodies that they touch
    """
    named: dict[str, int] = {}
    for i, tool in enumerate(tools):
        for length, name, owner in ((tool.edge_m, "edge_m", "punch"), (tool.length_m, "length_m", "capsule")):
            if length and tool.kind != owner:
                raise InputError(f"{place}[{i}].{name} is {length:g}, and a {tool.kind} has none; leave it out.")
        if tool.sticks and tool.kind == "grasp":
            raise InputError(f"{place}[{i}].sticks is true, and a grasp always holds what it has; leave it out.")
        if tool.edge_m > tool.radius_m:
            raise InputError(f"{place}[{i}].edge_m is {tool.edge_m:g}; give at most its radius_m, {tool.radius_m:g}.")
        if (scene := instrument_name(tool)) in named:
            raise InputError(
                f"{place}[{i}] has the kind and radius_m of instruments[{named[scene]}], by which tables tell "
                "instruments apart; change one, or remove it."
            )
        named[scene] = i
        for body in names:
            size = longest_m(bodies[body])
            for name, length in (("radius_m", tool.radius_m), ("length_m", tool.length_m)):
                if size is not None and length > size:
                    raise InputError(
                        f"{place}[{i}].{name} is {length:g}, and all of {body} is {size:g} m long; give it in metres."
                    )


def check_radii(config: Any, file: Path) -> None:
    """Raise InputError for a regime whose disc is wider than a body that it presses, as far as entries say its size."""
    for name in pressed_bodies(config):
        size = longest_m(config.bodies[name])
        for regime, entry in config.regimes.items():
            if size is not None and 2.0 * entry.radius_on(name) > size:
                raise InputError(
                    f"{file}: regimes.{regime} presses {name} with a disc of radius_m {entry.radius_on(name):g}, and "
                    f"the whole body is {size:g} m long; give the radius in metres (a fingertip has 0.012)."
                )
