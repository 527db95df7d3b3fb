"""Hard cases of laws, of starts (inverted, collapsed, random), of relaxation by local solvers, and of stability.

The last are columns under Euler's load or pushed as far, a thin lobe on its edge, an arch that snaps. Springs have to
find some equilibrium only: a mirror image is a rest state for them too, so they need not return.
"""

from dataclasses import replace
from functools import cache, partial

import numpy as np
from scipy import sparse
from scipy.optimize import brentq

from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import Load, Press, displacement_of
from palpate.benchmark.model import Case as ModelCase
from palpate.benchmark.model import Model
from palpate.bodies.body import Body, nest
from palpate.bodies.material import NAMED, stiffening_of
from palpate.bodies.mesh import TetMesh
from palpate.bodies.simple_shapes import box
from palpate.effects.elements import locking_is_measured
from palpate.effects.linear_elements import LinearElements
from palpate.effects.patch_load import nodal_load, patch_at, patch_shares
from palpate.models import kinds
from palpate.models.relaxed import relaxed
from palpate.scenes.run_scene import initial_positions
from palpate.solvers.compliance import compute_compliance
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.pushed_discs import push
from palpate.studies.hard_cases import fem_cases, stage
from palpate.studies.hard_cases.fem_cases import SOLVERS
from palpate.studies.hard_cases.model_cases import MEASURE
from palpate.studies.hard_cases.stage import EXPLICIT, FEM, RESIDUAL, SHAPES, SOFT, SPRINGS, Answer, Case


def laws() -> list[Case]:
    return [
        Case("each_law_crushed", "a bar under a press along its axis of half its Young's modulus, for each law",
             "equilibrium", RESIDUAL, 1e-6, partial(_residual, [-0.5, 0.0, 0.0]), NAMED),
        Case("each_law_inverting_force", "a sideways pull of twice Young's modulus, for each law",
             "equilibrium", RESIDUAL, 1e-6, partial(_residual, [0.0, 0.0, -2.0]), NAMED),
        Case("each_law_from_inside_out", "a bar is released at rest mirrored through its held end, for each law",
             "equilibrium", RESIDUAL, 1e-6, partial(_residual, [0.0, 0.0, -1e-3], mirrored=True), NAMED),
        Case("each_law_incompressible", "ν = 0.4999, quadratic elements, a bar bent by its end, for each law",
             "the deflection that scikit-fem computes", "relative error of the deflection", 0.05, _bent, NAMED,
             blunt=NAMED),
        Case("stiffening_pulled", "ν = 0, a bar is pulled along its axis by ten times its Young's modulus",
             "the elongation at which μ exp(b Q) (s − 1/s) is that traction", "relative error of the elongation", 1e-6,
             _pulled, NAMED[-1:]),
    ]  # fmt: skip


def _load(body: Body, moduli: list[float]) -> np.ndarray:
    """Return the nodal forces (n, 3) [N] of a traction on the bar's end, (3,) over Young's modulus."""
    return np.outer(stage.end_face(body.fine), np.array(moduli) * body.material.young_pa * 0.05**2)


def _residual(moduli: list[float], law: str, mirrored: bool = False) -> Answer:
    """Load a bar of a ``law`` by the traction of ``_load``, from rest or ``mirrored``, and judge the residual force."""
    body = stage.bar_body(1, replace(SOFT, law=law))
    load, rest = _load(body, moduli), body.fine.nodes
    start = rest * [-1.0, 1.0, 1.0] if mirrored else None
    error = stage.residual_error(LinearElements(body.fine, body.tissue(1)), load, body.anchors[1])
    return Answer(Equilibrium(body, 1).solve(load, 1e-8, start).x, rest if start is None else start, error, zero=rest)


def _pulled(law: str) -> Answer:
    """Pull a bar of exponential stiffness by 10 times Young's modulus, and compare with the closed stretch s."""
    body, b = stage.bar_body(1, replace(SOFT, poisson=0.0, law=law)), stiffening_of(law) or 0.0
    end_weights, traction = stage.end_face(body.fine), 10.0
    expected = brentq(lambda s: 0.5 * np.exp(b * (s * s - 1.0 - 2.0 * np.log(s))) * (s - 1.0 / s) - traction, 1.0, 3.0)
    moved = Equilibrium(body, 1).solve(_load(body, [traction, 0.0, 0.0]), 1e-9).x - body.fine.nodes
    elongation = 0.2 * (expected - 1.0)
    return Answer(moved, np.zeros_like(moved), lambda a: abs(float(end_weights @ a[:, 0]) / elongation - 1.0))


def _bent(law: str) -> Answer:
    """Compare the deflection of quadratic elements under a small load at the end with ``reference_deflection``."""
    body = stage.bar_body(1, replace(SOFT, poisson=fem_cases.POISSON, law=law))
    problem, load = Equilibrium(body, 0, 2), _load(body, [0.0, 0.0, -1e-4])
    newtons = float(np.abs(load).sum())
    unit_load, expected = load / newtons, newtons * fem_cases.reference_deflection()
    moved = problem.solve(load, 1e-6).x - problem.mesh.nodes
    return Answer(moved, np.zeros_like(moved), lambda a: abs(float(np.vdot(unit_load, a)) / expected - 1.0))


SOURCES = {
    "inverted": "Irving, Teran, Fedkiw 2004",
    "plane": "Smith, de Goes, Kim 2018",
    "line": "Smith, de Goes, Kim 2018",
    "point": "Li et al. 2020 (IPC), one point",
    "random": "Li et al. 2020 (IPC), random",
}
BREATH = 1e-9
"""Perturbation, relative to the body's size, of starts that have to return to rest. Trap: a start of exactly zero width
stays so, in an unstable equilibrium of the corotational energy, which is smoothed there, so that no force arises."""
GAIN = 1e-9
"""Largest gain of energy, relative to that at the start, that rounding may cause."""
WEIGHT = {"gravity": {"acceleration_m_s2": [0.0, 0.0, -0.05]}}


def starts() -> list[Case]:
    return [
        *(
            Case(f"start_{kind}", f"a free body starts {kind} and drifts", "its rest shape, where the drift takes it",
                 "largest relative error of edges or of the centre's way after 20 s", 0.01, partial(_recover, kind),
                 (*FEM, *SHAPES), source=source)
            for kind, source in SOURCES.items()
        ),
        *(
            Case(f"settles_from_{kind}", f"a held body starts exactly {kind}, under a weight",
                 "an equilibrium, without gain of energy",
                 "residual force / the weight; more than 1 if energy was gained", 0.2, partial(_settle, kind),
                 (*FEM, *SPRINGS, *(EXPLICIT if kind == "random" else ())),
                 # a spring of zero length has no direction, and rounding says whether one of them stays so
                 {"springs_implicit": ("stable", "not_converged")} if kind in ("line", "point") else {}, source=source)
            for kind, source in SOURCES.items()
        ),
    ]  # fmt: skip


def _recover(kind: str, model: str) -> Answer:
    """Release a free bar from initial positions of a ``kind``, perturbed by BREATH."""
    particles = stage.bar_particles(held=False)
    x = initial_positions(particles, np.ones(len(particles.nodes), dtype=bool), kind, seed=1)
    x = x + BREATH * particles.size * np.random.default_rng(2).normal(size=x.shape)
    return stage.recovery(model, particles, x)


def _settle(kind: str, model: str) -> Answer:
    """Release a held bar from initial positions of a ``kind`` under a small weight, and judge where it comes to rest.

    The error is the residual force over the weight, or 1 and more if the energy rose by more than GAIN.
    """
    particles = stage.bar_particles()
    start = initial_positions(particles, ~np.isin(np.arange(len(particles.nodes)), particles.held), kind, seed=1)
    stepper = stage.Stepper(
        model, particles, {"held": True} | WEIGHT | (stage.MASS_DAMPING if model in EXPLICIT else {})
    )
    x, v, relative_gain = start, np.zeros_like(start), 0.0
    start_energy = stepper.total_energy(x, v)
    # the last steps are so long that they damp the slowest mode to nothing
    for step_s, steps in [(5e-4, 10_000)] if model in EXPLICIT else [(0.05, 100), (1.0, 30)]:
        x, v = stepper.advance(x, v, step_s, steps)
        relative_gain = max(relative_gain, stepper.energy_gain / abs(start_energy))

    def error(a: np.ndarray) -> float:
        return stage.residual_of_weight(stepper.system, a) if relative_gain <= GAIN else 1.0 + relative_gain

    return Answer(x, start, error, zero=particles.nodes)


SETTINGS: dict[str, kinds.XPBD | kinds.VertexBlockDescent | kinds.ProjectiveDynamics] = {
    "xpbd": kinds.XPBD(steps=3000, iterations=1, step=0.3),
    "vertex_block_descent": kinds.VertexBlockDescent(sweeps=1500, radius=0.9999),
    "projective_dynamics": kinds.ProjectiveDynamics(iterations=400, memory=5),
}
"""Settings with so many iterations that the remaining error is that of the method, not of its convergence."""
LOAD = 0.01
"""Traction on the end of the bar, over Young's modulus, that bends it by a tenth of its length."""
ERROR = "RMS distance from the equilibrium that Newton's method finds / RMS displacement"


def relaxations() -> list[Case]:
    def case(name, scene, run):
        return Case(f"relaxed_{name}", scene, "the equilibrium of finite elements", ERROR, 0.03, run, SETTINGS)

    return [
        case("twice_the_load", "a bar is bent by a fifth of its length", partial(_relaxed, times=2.0)),
        case("three_times_the_load", "a bar is bent by three tenths of its length", partial(_relaxed, times=3.0)),
        case("from_inside_out", "a bent bar is released from where it is mirrored through its held end",
             partial(_relaxed, mirrored=True)),
        case("incompressible", "ν = 0.49: the pressure is far stiffer than the shear", partial(_relaxed, poisson=0.49)),
        case("slivers", "a layer of elements with dihedral angles of a degree", partial(_relaxed, thin=True)),
    ]  # fmt: skip


def _relaxed(
    method: str, times: float = 1.0, poisson: float = 0.3, mirrored: bool = False, thin: bool = False
) -> Answer:
    """Relax a bar under ``times`` LOAD by a local method, and compare with the equilibrium of Newton's method."""
    mesh = stage.bar_mesh()
    if thin:
        nodes = mesh.nodes.copy()
        beyond_layer = nodes[:, 0] > 0.03
        nodes[beyond_layer, 0] = np.maximum(0.025 * (1.0 + np.tan(np.radians(1.0))), nodes[beyond_layer, 0] - 0.0246)
        mesh = TetMesh(nodes, mesh.tetrahedra)
    held = mesh.nodes[:, 0] == 0.0
    body = nest("bar", mesh, 0, np.flatnonzero(held), replace(SOFT, poisson=poisson))
    load = np.outer(stage.end_face(mesh), [0.0, 0.0, times * LOAD * body.material.young_pa * 0.05**2])
    with locking_is_measured():
        moved = Equilibrium(body, 0).solve(load, 1e-10).x - mesh.nodes
    start = mesh.nodes * [-1.0, 1.0, 1.0] if mirrored else mesh.nodes
    x = relaxed(method, body, 0, held, SETTINGS[method]).relax(start, load)[0]

    def error(a: np.ndarray) -> float:
        return float(np.linalg.norm(a - mesh.nodes - moved) / np.linalg.norm(moved))

    return Answer(x, start, error, zero=mesh.nodes, origin=mesh.nodes)


REDUCED, STORED = ("contact_modes",), ("linear_fem", "warped_compliance")
RADIUS_M = 0.02
ANSWERING: dict[str, Model] = {
    "contact_modes": kinds.ContactModes(nodes=1),
    "linear_fem": kinds.LinearFEM(),
    "warped_compliance": kinds.WarpedCompliance(),
}
"""Contact modes reduce the coarse level, which alone has so few nodes."""
EULER_N = np.pi**2 * SOFT.young_pa * 0.05**4 / 12.0 / (4.0 * 0.2**2)
"""Buckling load of the bar, held at one end and free at the other."""
POST_M = 0.6
SHORTENED_M = 4.4934**2 * 0.05**2 / 12.0 / POST_M
"""How far its buckling load (kL)² EI / L² shortens a post of square section whose pushed end is held from the side and
may turn: tan kL = kL, as with one end clamped and one pinned."""
PRESSES = {
    "column": ([0.2, 0.025, 0.025], [-EULER_N, 0.0, 0.0]),
    "post": ([POST_M, 0.025, 0.025], [-SHORTENED_M, 0.0, 0.0]),
    "lobe": ([0.1, 0.04, 0.004], [-0.004, 0.0, 0.0]),
    "arch": ([0.1, 0.015, 0.028], [0.0, 0.0, -0.06]),
}
"""Where each body is pressed [m], and by what [N]: Euler's load, and about those at which the others give way. The post
is pushed so far [m]."""
BOXES = {
    "post": ([POST_M, 0.05, 0.05], [12, 2, 2]),
    "lobe": ([0.1, 0.08, 0.008], [6, 4, 1]),
    "arch": ([0.2, 0.03, 0.008], [12, 2, 1]),
}
"""Sides [m] and divisions of each body but the column; the arch is bent afterwards."""


def stability() -> list[Case]:
    measure = f"{RESIDUAL}; more than 1 if the stiffness there is not positive"

    def solved(name, scene, body, times):
        return Case(name, scene, "a stable equilibrium", measure, 1e-6, partial(_solved, body, times), SOLVERS)

    def asked(name, scene, body, times, models=REDUCED, tilt=0.0):
        run, declared = partial(_asked, body, times, tilt), ("stable", "not_converged")
        return Case(name, scene, "the answer, or it is told", MEASURE, 0.02, run, models, declared)

    return [
        Case("column_at_0.5_asked", "a bar is pressed along its axis by half of Euler's load", "the answer", MEASURE,
             0.02, partial(_asked, "column", 0.5, 0.0), REDUCED),
        *(
            case(f"column_at_{times:g}_{suffix}", f"a bar is pressed along its axis by {times:g} of Euler's load",
                 "column", times)
            for times in (0.9, 1.0, 1.4)
            for case, suffix in ((solved, "solved"), (asked, "asked"))
        ),
        *(
            Case(f"post_pushed_to_{times:g}_solved",
                 f"a post's end is pushed along its axis by {times:g} of the way at which it buckles",
                 "a stable equilibrium", f"{measure}; or the share of the way that is missed", 1e-6,
                 partial(_pushed, times), ("fem_quadratic",))
            for times in (0.9, 1.05, 1.4, 3.0)
        ),
        *(
            asked(f"post_pushed_to_{times:g}_asked", "the same", "post", times, REDUCED + STORED)
            for times in (0.9, 1.4, 3.0)
        ),
        asked("column_off_its_axis", "a bar is pressed by half of Euler's load, 5° off its axis", "column", 0.5,
              STORED, 5.0),
        solved("lobe_on_edge_solved", "a thin plate is pressed on its free edge until it buckles", "lobe", 2.0),
        asked("lobe_on_edge_asked", "the same", "lobe", 2.0),
        solved("arch_snaps_solved", "a shallow arch is pressed at its crown until it snaps", "arch", 1.5),
        asked("arch_snaps_asked", "the same", "arch", 1.5),
        asked("arch_before_it_snaps_asked", "the same, by half of that load", "arch", 0.75),
    ]  # fmt: skip


@cache
def body_of(name: str) -> Body:
    """Make the body of one of PRESSES, of two levels, held at one end; the arch is held at both."""
    if name == "column":
        return stage.bar_body(1)
    mesh = box(*BOXES[name])
    x, held_x = mesh.nodes[:, 0], [0.0]
    if name == "arch":
        rise, held_x = 0.02 * (1.0 - (10.0 * x - 1.0) ** 2), [0.0, x.max()]
        mesh = TetMesh(mesh.nodes + np.outer(rise, [0.0, 0.0, 1.0]), mesh.tetrahedra)
    return nest(name, mesh, 1, np.flatnonzero(np.isin(x, held_x)), SOFT)


def press_of(name: str, times: float, tilt: float = 0.0) -> tuple[int, np.ndarray]:
    """Return the node of one of PRESSES, and ``times`` its force [N] or displacement [m] with a ``tilt`` in degrees."""
    place, force = PRESSES[name]
    body = body_of(name)
    surface = body.coarse.surface
    node = int(surface[np.argmin(np.linalg.norm(body.coarse.nodes[surface] - place, axis=1))])
    sideways = np.tan(np.radians(tilt)) * np.linalg.norm(force)
    return node, times * np.add(force, [0.0, sideways, 0.0])


def _solved(name: str, times: float, model: str) -> Answer:
    """Solve for equilibrium; the error is the residual over the load, plus 1 if the stiffness is indefinite."""
    body, (node, force) = body_of(name), press_of(name, times)
    solver, load = SOLVERS[model](body, 0, 2), nodal_load(body, 0, node, force, RADIUS_M, order=2)
    x, rest = solver.solve(load, 1e-8).x, solver.mesh.nodes
    solver.carry(load)
    multiply, _ = solver.linearise(x)
    unit_vectors = np.eye(3 * len(x)).reshape(len(x), 3, -1)
    stable = np.linalg.eigvalsh(multiply(unit_vectors).reshape(3 * len(x), -1))[0] > 0.0

    def error(a: np.ndarray) -> float:
        residual = float(np.linalg.norm(solver.force(a)) / np.linalg.norm(load))
        return residual if stable else 1.0 + residual

    return Answer(x, rest, error)


def _pushed(times: float, model: str) -> Answer:
    """Push the disc at the end of the post along the post.

    The error is the larger of the residual force in motions that leave the disc in place, over all forces, and of the
    relative error of the disc's displacement; 1 plus the former if the stiffness in these motions is not positive.
    """
    body, (node, wanted_m) = body_of("post"), press_of("post", times)
    solver = SOLVERS[model](body, 0, 2)
    rest = solver.mesh.nodes
    disc_nodes, disc_shares = patch_shares(body.coarse, patch_at(body, node, RADIUS_M), 2)
    weights = sparse.csr_array((disc_shares, (np.zeros_like(disc_nodes), disc_nodes)), (1, len(rest)))
    x = push(solver, np.zeros_like(rest), weights, wanted_m[None], 1e-8)[0].x
    free_motions = np.linalg.qr(np.kron(weights.toarray(), np.eye(3)).T, "complete")[0][:, 3:]  # the disc stays
    multiply, _ = solver.linearise(x)
    tangent = free_motions.T @ multiply(free_motions.reshape(len(x), 3, -1)).reshape(len(free_motions), -1)
    stable = np.linalg.eigvalsh(tangent)[0] > 0.0

    def error(a: np.ndarray) -> float:
        forces = solver.force(a).ravel()
        residual = float(np.linalg.norm(free_motions.T @ forces) / np.linalg.norm(forces))
        missed = float(np.linalg.norm((weights @ (a - rest))[0] - wanted_m) / np.linalg.norm(wanted_m))
        return max(residual, missed) if stable else 1.0 + residual

    return Answer(x, rest, error)


def _asked(name: str, times: float, tilt: float, model: str) -> Answer:
    """Ask a model for a press, and compare with quadratic elements, which may have buckled to either side."""
    body = body_of(name)
    node, force = press_of(name, times, tilt)
    case, load = _case(name), Load((Press(node, moved=force),)) if name == "post" else Load.at(node, force)
    answer = displacement_of(ANSWERING[model].prepare(case).respond(load))
    expected = displacement_of(kinds.FEM(order=2, level=0, tolerance=1e-6).prepare(case).respond(load))
    surface = body.fine.surface
    mirrored_places = body.fine.nodes[surface] * [1.0, -1.0, 1.0] + [0.0, np.ptp(body.fine.nodes[:, 1]), 0.0]
    distance = np.linalg.norm(body.fine.nodes[surface][None] - mirrored_places[:, None], axis=2)
    mirrored = expected[distance.argmin(axis=1)] * [1.0, -1.0, 1.0]

    def error(a: np.ndarray) -> float:
        return min(errors(a, either_side).rmse_of_peak for either_side in (expected, mirrored))

    return Answer(answer, np.zeros_like(answer), error)


def _case(name: str) -> ModelCase:
    """Return what models of one of PRESSES are prepared from: its body and the response to unit forces at its node."""
    body, (node, _) = body_of(name), press_of(name, 1.0)
    case = ModelCase.untrained(body, "hard", RADIUS_M, 0, 1e-8)
    return replace(case, response=compute_compliance(body, RADIUS_M, contacts=np.array([node]), order=2))
