"""Forces of presses on an organ of known shape: a half-space in series with the organ's compliance, and elements.

A ball dents tissue as it dents a half-space, and the organ gives way as a whole. The dent follows the law of the tissue
(``SlabForward`` without a thickness). The far compliance is linear: the displacement of linear elements under a small
patch at the place, less that of a half-space (Johnson 1985, section 3.4). This series model lacks the curvature of the
surface and large bending. Quadratic elements at each place have both, but for one Poisson's ratio and one stiffening
only. So the force is that of the elements, times the ratio by which the series model changes with the parameters.
"""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.interpolate import PchipInterpolator

from palpate.benchmark.touch import Touch, places_to_touch
from palpate.benchmark.touch_mesh import TouchedMeshes, contact_radius
from palpate.bodies.body import Body
from palpate.bodies.material import EXPONENTIAL, exponential
from palpate.bodies.mesh import TetMesh
from palpate.effects.elements import PLAIN_POISSON
from palpate.effects.instrument import SPHERE, Instrument, first_touch, upright
from palpate.effects.patch_load import Patch, patch_shares
from palpate.errors import InputError, NotConverged
from palpate.identification.forward import Forward, Parameter
from palpate.identification.presses import Press
from palpate.solvers.equilibrium import Equilibrium

HALF_SPACE = 2048.0 / (315.0 * np.pi**2)
"""E a / (1 − ν²) times the compliance of a half-space under a disc: the mean displacement by a unit force, with the
pressure 1 − (r/a)² as its weight. By Hankel's transform it is 64/π ∫ J₂(x)² x⁻⁴ dx, an integral of Weber and
Schafheitlin."""
ALONG, STIFFER = 1.0, 0.021
"""Least number of elements along the radius of the deepest contact, and the relative error of force where one element
is as long as the contact's radius, which falls with the square of its length."""
RATES = (2.0, 3.0)
"""Least and greatest rate of convergence at the rim of what is held: there displacements grow as roots of distances."""
TOGETHER, FEWEST = 4, 3
"""Places that are solved for at once; fewest depths that make a curve, where elements have no answer beyond."""
SHARES = (0.3, 0.45, 0.6, 0.8, 1.0)
"""Depths of a curve of elements over the deepest; below, elements are too long for what touches."""
TOLERANCE = 1e-3
MARGIN = 1.15
"""Deepest depth that is answered over that of the presses: where they first touched is not known to the last."""
APART = 0.03
"""Least range of Poisson's ratios that a change with them is found from."""
LOCAL = 48
"""Points of the half-space's curve between which the model in series is interpolated."""


@dataclass(frozen=True, eq=False)
class Place:
    """Answers of elements at one place of an organ, for Young's modulus 1 Pa.

    depth_m, force_n : (k,) [m], [N], for one Poisson's ratio
    cosine : between the direction of the press and the inward normal
    far : far compliance, that of the organ less a half-space's [m/N], coefficients (n,) of a polynomial in ν
    """

    depth_m: np.ndarray
    force_n: np.ndarray
    cosine: float
    far: np.ndarray


class OrganForward:
    """Forward model of presses of a ball on an organ; see ``Forward``.

    body : of one tissue, whose own modulus does not matter; the stiffness of a bed is in proportion to it
    presses : with a place and a direction each; those that have both in common share one simulation by elements
    local : the half-space's forward model of the same ball, to the same depth; its parameters are the organ's
    law : of the elements; ``exponential`` takes the middle of the range of ``stiffening``
    known : poisson and stiffening where they are no parameters; poisson is the body's unless given
    Raises InputError for presses that are off the body, on what is held or without place and direction, for another
    instrument than a ball, and for one that is larger than the body; NotConverged where elements have no answer.
    """

    relative_error = 0.024
    """Root mean square at 16 places of a liver, balls of 4 and 8 mm, 0.3 and 0.75 radii deep, rims of lobes and the
    neighbourhood of what is held included, which have the largest errors, of 9 and 8 %; half of all are below 1 %."""
    common_error = 0.018
    """Of the modulus that is fitted to presses of the liver's truth, with first touch unknown: forces have a mean error
    of 0 (± 0.7 %), but rise with an exponent that is 0.02 too small, for which first touch makes up."""

    def __init__(
        self,
        body: Body,
        instrument: Instrument,
        presses: Sequence[Press],
        local: Forward,
        law: str = "neo_hookean",
        known: Mapping[str, float] | None = None,
    ):
        self._local, self.parameters = local, tuple(local.parameters)
        self.deepest_m = min(MARGIN * max(float(press.depth_m.max()) for press in presses), local.deepest_m)
        _check(body, instrument)
        middle = {"poisson": body.material.poisson, "stiffening": 0.0} | dict(known or {})
        middle |= {each.name: _middle(each) for each in self.parameters}
        self._middle, ratios = middle, next((each for each in self.parameters if each.name == "poisson"), None)
        nu = middle["poisson"]
        ratios_nu = np.array([nu]) if ratios is None else _ratios_of_one_element(ratios)
        law_name = exponential(middle["stiffening"]) if law == EXPONENTIAL else law
        tissue = replace(body, material=replace(body.material, poisson=float(nu), law=law_name))
        keys = [_place_and_direction(press) for press in presses]
        first_presses = [keys.index(key) for key in dict.fromkeys(keys)]
        touches = [touch_of(tissue, instrument, presses[i], self.deepest_m) for i in first_presses]
        self._place_of_press = [first_presses.index(keys.index(key)) for key in keys]
        with ProcessPoolExecutor(os.cpu_count()) as pool:  # a second or two a place
            simulated = list(pool.map(partial(_simulate, tissue), touches))
        missed_at_rim, far_by_ratio = _far_compliances(tissue, touches, ratios_nu)
        self._places = [
            _with_far_field(*each, ratios_nu, nu) for each in zip(simulated, missed_at_rim, far_by_ratio, strict=True)
        ]
        # force of elements over that of the series model, by the depths [m] that elements reach
        self._scales = [
            PchipInterpolator(place.depth_m, place.force_n / self._in_series(place, place.depth_m, middle))
            for place in self._places
        ]

    def forces(self, press: int, depth_m: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """Return the forces (k,) [N] of press number ``press`` at ``depth_m`` (k,) [m] for young_pa = 1."""
        depth = np.asarray(depth_m, dtype=float)
        if depth.size and depth.max() > self.deepest_m * (1.0 + 1e-9):
            raise InputError(f"a depth is {depth.max():.3g} m; curves go to {self.deepest_m:.3g} m.")
        place, scale = self._places[self._place_of_press[press]], self._scales[self._place_of_press[press]]
        return self._in_series(place, depth, values) * scale(np.clip(depth, place.depth_m[0], place.depth_m[-1]))

    def _in_series(self, place: Place, depth: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """Return the forces (k,) [N] of the series model at ``depth`` (k,) [m]: a half-space and the far compliance."""
        far = float(np.polyval(place.far, values.get("poisson", self._middle["poisson"])))
        dent = self.deepest_m * np.linspace(0.0, 1.0, LOCAL) ** 1.5
        force = self._local.forces(0, dent, values)
        depths = np.maximum.accumulate(dent + far * force + 1e-9 * dent)
        if depths[-1] < self.deepest_m:  # a thin place on a base gives way less than a half-space
            depths = np.append(depths, self.deepest_m)
            force = np.append(force, force[-1] * (depths[-1] / depths[-2]) ** 1.5)
        # F^(2/3) is nearly straight
        curve = PchipInterpolator(depths, force ** (2.0 / 3.0))
        return place.cosine * curve(np.clip(depth, 0.0, None) * place.cosine) ** 1.5


def _with_far_field(place: Place, rim: float, coarse_far: np.ndarray, ratios_nu: np.ndarray, nu: float) -> Place:
    """Return a place whose far compliance is a polynomial in Poisson's ratio and holds what its mesh misses.

    rim : compliance that the mesh misses at the rim of what is held [m/N]
    coarse_far : (n,) far compliance on a coarse mesh [m/N], for each of ``ratios_nu``; nu : the ratio of ``place``
    """
    degree = len(ratios_nu) - 1
    # the coarse curve is shifted to the fine compliance at nu; it lacks some of the dent, which goes as 1 - nu^2
    lacking = (place.far[0] - np.polyval(np.polyfit(ratios_nu, coarse_far, degree), nu)) / (1.0 - nu**2)
    far = np.polyfit(ratios_nu, coarse_far + lacking * (1.0 - ratios_nu**2), degree)
    far[-1] += rim
    # displacements at the rim are in proportion to the force, and add to the depth
    return replace(place, depth_m=place.depth_m + rim * place.force_n, far=far)


def _ratios_of_one_element(ratios: Parameter) -> np.ndarray:
    """Return three Poisson's ratios of a range for which elements are of one kind, compressible or mean-dilatation.

    Beyond these, far compliances are extrapolated. Trap: mean-dilatation elements are softer, so that across both kinds
    the far compliance of a block seems to grow with the ratio.
    """
    if ratios.low < PLAIN_POISSON - APART:
        return np.linspace(ratios.low, min(ratios.high, PLAIN_POISSON), 3)
    return np.linspace(max(ratios.low, PLAIN_POISSON + 1e-3), max(ratios.high, PLAIN_POISSON + APART), 3)


def _middle(parameter: Parameter) -> float:
    """Return the value of a parameter for which elements are solved: the middle of its range.

    The middle of a stiffening, which may be 0, is that of log(1 + stiffening). Sticking is the least, as elements slip.
    """
    if parameter.name == "sticking":
        return parameter.low
    if parameter.name == "stiffening":
        return float(np.sqrt((1.0 + parameter.low) * (1.0 + parameter.high)) - 1.0)
    return 0.5 * (parameter.low + parameter.high)


def _check(body: Body, instrument: Instrument) -> None:
    """Raise InputError for an instrument that is no ball or larger than the body, and a body of no single tissue."""
    size = body.fine.size
    if instrument.kind != SPHERE:
        raise InputError(f"a {instrument.kind} is no ball, of which curves are known; identify from presses of a ball.")
    if 2.0 * instrument.radius_m >= size:
        raise InputError(
            f"the ball of {2e3 * instrument.radius_m:.3g} mm is larger than bodies.{body.name} of {1e3 * size:.3g} mm; "
            "check its radius_m and the body's scale_m."
        )
    if not isinstance(body.coarse, TetMesh):
        raise InputError(f"bodies.{body.name} is a sheet, which a ball does not dent; take a solid.")
    if body.regions is not None:
        raise InputError(
            f"bodies.{body.name} has regions, whose stiffness does not follow the modulus that is looked for; "
            "leave them out."
        )


def _place_and_direction(press: Press) -> tuple:
    """Return the rounded place and direction of a press, by which presses share a simulation; InputError without."""
    if press.at_m is None or press.direction is None:
        raise InputError(
            f"press {press.name} has no place or direction; give x_m, y_m, z_m and direction_x, direction_y, "
            "direction_z, or identify on a slab."
        )
    return (*np.round(press.at_m, 7), *np.round(press.direction, 4))


def touch_of(body: Body, instrument: Instrument, press: Press, deepest_m: float) -> Touch:
    """Return the press as a touch of ``body`` to the depth ``deepest_m`` [m], from the pose of first touch on.

    InputError for a press that is off the body, points out of it, is on what is held, or is too deep.
    """
    assert press.at_m is not None and press.direction is not None
    mesh, direction = body.fine, press.direction / np.linalg.norm(press.direction)
    allowed = places_to_touch(body)
    node = int(mesh.surface[np.linalg.norm(mesh.nodes[mesh.surface] - press.at_m, axis=1).argmin()])
    try:
        pose = first_touch(upright(instrument, press.at_m, -direction), mesh, direction)
        distance_off = abs(float((pose.tip - press.at_m) @ direction))
    except InputError:
        distance_off = np.inf
    if distance_off > instrument.radius_m:
        raise InputError(
            f"press {press.name} at {np.round(press.at_m, 4).tolist()} m is off bodies.{body.name}; give places on its "
            "surface, in metres and in its axes."
        )
    if direction @ mesh.normals[node] >= 0.0:
        raise InputError(f"press {press.name} points out of bodies.{body.name}; give directions into the tissue.")
    if node not in allowed:
        raise InputError(f"press {press.name} is where bodies.{body.name} is held, or beside; leave it out.")
    if deepest_m >= float(np.ptp(mesh.nodes @ direction)):
        raise InputError(f"press {press.name} is deeper than bodies.{body.name} is thick; check the unit of depth_m.")
    return Touch(instrument, node, direction, deepest_m, {body: pose})


def _simulate(body: Body, touch: Touch) -> Place:
    """Press quadratic elements at a place, refined there; the far compliance is at the body's Poisson's ratio only.

    Where elements have no answer beyond FEWEST depths, the curve ends there; NotConverged where it has fewer.
    """
    touch = replace(touch, poses=dict(zip([body], touch.poses.values(), strict=True)))  # another process has its own
    meshes, young, depths, forces = TouchedMeshes(body), body.material.young_pa, [], []
    level = meshes.level_for(touch, ALONG)
    mesh = meshes.around(touch, 0, level)
    try:
        for state in mesh.contact.push(touch.direction, [share * touch.depth_m for share in SHARES], TOLERANCE):
            depths.append(state.depth_m)
            forces.append(float(state.force @ touch.direction) / young)
    except NotConverged:
        if len(forces) < FEWEST:
            raise
    depth, edge_m = np.array(depths), meshes.edge_m(touch, level)
    contact_m = np.array([contact_radius(touch.instrument, depth_m) for depth_m in depths])
    force = np.array(forces) / (1.0 + STIFFER * (edge_m / contact_m) ** 2)
    patch = _patch(body, touch, contact_radius(touch.instrument, 0.5 * touch.depth_m))
    far = far_compliance(mesh.body, mesh.level, [patch])
    return Place(depth, force, float(-touch.direction @ patch.normal), far)


def _patch(body: Body, touch: Touch, radius_m: float) -> Patch:
    return Patch(touch.poses[body].tip, body.fine.normals[touch.node], radius_m)


def far_compliance(body: Body, level: int, patches: Sequence[Patch]) -> np.ndarray:
    """Return the linear compliance under each of k patches, less a half-space's, (k,) [m/N] for E = 1 Pa.

    level : of ``body``, with quadratic elements
    """
    solver, mesh, compliances = Equilibrium(body, level, 2), body.levels[level], []
    solve, young, plane_factor = solver.linear_solver(TOLERANCE), body.material.young_pa, 1.0 - body.material.poisson**2
    for some in (patches[i : i + TOGETHER] for i in range(0, len(patches), TOGETHER)):
        loads, spread = np.zeros((*solver.mesh.nodes.shape, len(some))), [patch_shares(mesh, each, 2) for each in some]
        for i, (patch, (nodes, shares)) in enumerate(zip(some, spread, strict=True)):
            loads[nodes, :, i] = np.outer(shares, -patch.normal)
        moved = solve(loads)
        for i, (patch, (nodes, shares)) in enumerate(zip(some, spread, strict=True)):
            organ = -float(shares @ moved[nodes, :, i] @ patch.normal) * young
            compliances.append(organ - HALF_SPACE * plane_factor / patch.radius_m)
    return np.array(compliances)


def _far_compliances(body: Body, touches: Sequence[Touch], ratios: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what far compliances of coarse elements miss at the rim of what is held, (k,), and these, (k, m) [m/N].

    ratios : (m,) Poisson's ratios of the second result
    What they miss is the limit of ever finer elements at the rim, less the answer of the coarsest. Both results are for
    E = 1 Pa, on one mesh for all k touches: under patches as wide as its elements, which is enough for differences.
    """
    meshes = TouchedMeshes(body)
    patches = [_patch(body, touch, meshes.edge_m(touch, 1)) for touch in touches]
    levels = np.array([far_compliance(*meshes.at_rim(held), patches) for held in (0, 1, 2)])
    change_1, change_2 = levels[1] - levels[0], levels[2] - levels[1]
    rate = np.clip(np.divide(change_1, change_2, out=np.full(len(change_2), RATES[1]), where=change_2 != 0.0), *RATES)
    missed = levels[2] + change_2 / (rate - 1.0) - levels[0]
    held, level = meshes.at_rim(1)
    bodies = [replace(held, material=replace(held.material, poisson=float(nu))) for nu in ratios]
    by_poisson = np.array([far_compliance(each, level, patches) for each in bodies]) if len(ratios) > 1 else levels[:1]
    return missed, by_poisson.T
