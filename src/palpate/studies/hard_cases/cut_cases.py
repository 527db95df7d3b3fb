"""Hard cases of cuts: where the blade passes, what it leaves, and what hooks then do.

What is severed whole has a closed solution: a piece follows its hook without a force, and what is held or free stays.
Where a cut runs along faces of a mesh, the same mesh is made by hand with nodes of its own on both lips, and solved by
scikit-fem, which knows nothing of palpate's cuts, elements or solvers.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from palpate.benchmark.cut_truth import Hook
from palpate.bodies.body import Body, nest
from palpate.bodies.cutting.cut import Blade, Cut, Disc, blade, make_cut
from palpate.bodies.cutting.settings import CutSettings
from palpate.bodies.cutting.ways import REMOVAL, SPLIT_FACES, VIRTUAL_NODES, part
from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import Mesh, TetMesh, unit
from palpate.bodies.organs import liver
from palpate.bodies.simple_shapes import box
from palpate.effects.linear_elements import LinearElements
from palpate.models.cut import elements, linear
from palpate.models.cut.elements import CONFORM, Nodes
from palpate.models.cut.opened import CutCase, CutModel
from palpate.models.relaxed import CutRelaxed
from palpate.models.springs.mass_spring import DELETED, CutSprings
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.grasping import Grasping, patch_around
from palpate.studies.hard_cases import stage
from palpate.studies.hard_cases.stage import SOFT, Answer, Case

RELAXED: dict[str, dict[str, Any]] = {
    "xpbd": {"step": 0.5, "steps": 400, "iterations": 2},
    "projective_dynamics": {"iterations": 30, "memory": 5},
    "vertex_block_descent": {"sweeps": 300, "radius": 0.998},
}
REMOVED, CONFORMING = "elements_removal", "elements_conform"
MODELS: dict[str, Callable[[CutCase], CutModel]] = {
    **{f"elements_{way}": partial(elements.online, level=0, way=way) for way in (REMOVAL, SPLIT_FACES, VIRTUAL_NODES)},
    "updated_responses": partial(linear.online, level=0, update=True),
    **{name: partial(CutRelaxed, name, level=0, **more) for name, more in RELAXED.items()},
    CONFORMING: partial(elements.online, level=0, way=CONFORM),
    **{
        f"springs_{way}": partial(CutSprings, level=0, way=way, iterations=100)
        for way in (DELETED, SPLIT_FACES, VIRTUAL_NODES)
    },
}
"""What makes each model ready for a cut."""
SAME = tuple(MODELS)[:7]
"""Those that end, where a cut runs along faces, at the equilibrium of linear elements on one mesh."""
EXACT = tuple(name for name in SAME if name != "xpbd")
"""Those of them that get there soon."""
NEAR_M = 1e-9
"""How near [m] a cut is to nodes, edges and faces; beside it a place belongs to either lip."""
DOWN = np.array([0.0, 0.0, -1.0])
SLAB_M, CELL_M = (0.1, 0.1, 0.04), 0.0125
OBLIQUE, DIAGONAL = np.array([1.0, 0.31, 0.17]), np.array([1.0, 1.0, 0.0])
DEEP_M = 0.02
"""Depth [m] of cuts of the slab: two of its four layers."""
SMALL_M = 1e-4
"""How far [m] hooks pull where linear elasticity is the independent answer."""
SEVERED = "error of the surface's motion over that of theory, or a hook's force over what it was before the cut"
MADE = "L2 error of the surface's motion, or of the hooks' forces, from scikit-fem's on a mesh that was made so"


@dataclass(frozen=True, eq=False)
class Expected:
    """What a pull does.

    moved : (n, 3) [m] of the body's surface nodes; force : (h,) [N] of hooks; newtons : what errors of it are over
    """

    moved: np.ndarray
    force: np.ndarray
    newtons: float


def cases() -> list[Case]:
    def severed(name: str, scene: str, run: Callable[[str], Answer], **more: Any) -> Case:
        bounds = {"vertex_block_descent": 0.04, "xpbd": 0.04} | more.pop("bounds", {})
        return Case(f"cut_{name}", scene, "the piece follows its hook without a force; what is held or loose stays",
                    SEVERED, 1e-4, run, tuple(MODELS), bounds=bounds, **more)  # fmt: skip

    def made(name: str, scene: str, run: Callable[[str], Answer], models: Sequence[str] = EXACT, **more: Any) -> Case:
        expected = more.pop("expected", "the answer of the same mesh, made with two lips by hand")
        return Case(f"cut_{name}", scene, expected, MADE, more.pop("bound", 0.004), run, models, **more)

    loose = {CONFORMING: ("refused",)}
    near = "a cut severs a bar, {} m beside {}"
    middle = np.array([0.1, 0.025, 0.025])
    return [
        severed("near_nodes", near.format(f"{NEAR_M:g}", "a node that it would meet at an angle"),
                partial(_of_bar, _plane(middle + NEAR_M * unit(OBLIQUE), OBLIQUE))),
        severed("near_edges", near.format(f"{NEAR_M:g}", "the edges that are diagonals of its cells"),
                partial(_of_bar, _plane(middle - NEAR_M * unit(DIAGONAL), DIAGONAL))),
        made("near_faces", f"a cut of a slab's top, {3 * NEAR_M:g} m askew to faces that it runs along",
             partial(_of_slab, off_m=NEAR_M, turn_m=2.0 * NEAR_M), SAME, bounds={"xpbd": 0.04}),
        severed("two_that_cross", "two cuts cross in a slab: of four pieces one is held, one is pulled, two are loose",
                _crossing, declared=loose | {"springs_deleted": ("wrong",)}),
        severed("along_held", "a cut along the held end of a bar, within the first layer of elements", _held,
                declared={REMOVED: ("wrong",)}),
        made("through_held", "a cut through the held end of a bar, to its middle; the bar is bent", _prongs, SAME,
             bounds={"xpbd": 0.045}),
        made("free_piece", "a severed bar whose held half is bent, while nothing holds or pulls the other", _half,
             (*EXACT, CONFORMING), declared=loose, expected="the held half is a bar of its own, and the other stays"),
        Case("cut_free_piece_weighs", "gravity acts on both halves of a severed bar", "refused: nothing holds one",
             SEVERED, 0.0, _weighs, ("statics",), {"statics": ("refused",)}),
        made("slivers", "a cut a hundredth of an edge beside faces, which leaves slices of a layer of elements",
             partial(_of_slab, off_m=0.01 * CELL_M), bound=0.01, declared={REMOVED: ("wrong",)}),
        made("stops_midway", "a blade that stops in the middle of elements", _midway, bound=0.03,
             expected="the answer of a mesh that was made for a blade at one or the other end of these elements"),
        made("without_area", "a cut without depth", _nothing, expected="the answer of the whole body"),
        Case("cut_outside", "a cut beside the body", "refused", SEVERED, 0.0, _outside, ("blade",),
             {"blade": ("refused",)}),
        made("deeper_than_body", "a blade that is ten times as long as the slab is high", _through),
        made("parallel_to_skin", "a cut below the skin of a slab and parallel to it, whose flap is lifted", _flap, SAME,
             bounds={"xpbd": 0.02}),
        made("incompressible", "a cut through the held end of a bar of ν = 0.49",
             partial(_prongs, poisson=0.49, order=2), ("elements_virtual_nodes", CONFORMING), bound=0.04,
             declared={"elements_virtual_nodes": ("wrong",)},
             expected="the answer of Taylor–Hood elements on finer elements; linear ones are known to lock"),
        made("stiff_beside_soft", "a cut along the face between tissue and what is a million times as stiff",
             partial(_of_materials, young_pa=[3e3, 3e9], along=1)),
        made("several_materials", "a cut through layers of three materials", partial(_of_materials, along=0)),
        Case("cut_pulled_far", "the lips of a cut are pulled apart by as much as the slab is wide",
             "the equilibrium of a mesh that was made so; linear responses know no large strains",
             MADE.replace("scikit-fem's", "that"), 0.004, _far, SAME, {"updated_responses": ("wrong",)}),
        severed("organ", "a lobe of the shipped liver is cut off, on its coarse mesh", _lobe,
                bounds={"springs_deleted": 0.045}),
    ]  # fmt: skip


def _pulled(model: str, case: CutCase, expected: Sequence[Expected]) -> Answer:
    """Return the answer of a model, whose error is that from the nearest of those that are ``expected``."""
    ready = MODELS[model](case)
    ready.cut(case.cuts)
    pulled, surface = ready.pull(), case.body.fine.nodes[case.body.fine.surface]
    # places within NEAR_M of a cut are on both lips
    seen = np.all([np.abs(cut.across(surface)) > 10.0 * NEAR_M for cut in case.cuts], axis=0)
    hooks, found = len(case.hooks), np.append(pulled.displacement[seen].ravel(), pulled.force)

    def error(a: np.ndarray) -> float:
        return min(_off(a[:-hooks].reshape(-1, 3), a[-hooks:], seen, each) for each in expected)

    return Answer(found, np.zeros_like(found), error)


def _off(moved: np.ndarray, force: np.ndarray, seen: np.ndarray, expected: Expected) -> float:
    right = expected.moved[seen]
    off = np.linalg.norm(moved - right) / np.linalg.norm(right)
    return float(max(off, np.linalg.norm(force - expected.force) / expected.newtons))


def _hook(body: Body, at_m: Sequence[float], shift_m: Sequence[float], radius_m: float) -> Hook:
    surface = body.fine.surface
    node = surface[np.linalg.norm(body.fine.nodes[surface] - at_m, axis=1).argmin()]
    return Hook(patch_around(body.fine, int(node), radius_m), np.array(shift_m))


def _plane(point_m: Sequence[float] | np.ndarray, normal: Sequence[float] | np.ndarray) -> Disc:
    return Disc(np.array(point_m), unit(np.array(normal)), 1.0)


def _slab(tissue: Material | Tissue = SOFT, held_at: int = 2) -> Body:
    """Make a slab in cells of CELL_M, which is held at its bottom, or where another coordinate is 0."""
    mesh = box(list(SLAB_M), [8, 8, 4])
    held, regions = np.flatnonzero(mesh.nodes[:, held_at] == 0.0), tissue if isinstance(tissue, Tissue) else None
    return nest("slab", mesh, 0, held, SOFT if isinstance(tissue, Tissue) else tissue, regions=regions)


def _severed(model: str, body: Body, cuts: Sequence[Cut], hook: Hook) -> Answer:
    """Pull a piece, on the positive side of all cuts, that is held by nothing but the hook."""
    nodes = body.fine.nodes[body.fine.surface]
    follows = np.all([cut.across(nodes) >= 0.0 for cut in cuts], axis=0)
    before = Grasping(body, 0, 1, hook.patch)
    (state,) = before.push(unit(hook.shift_m), [float(np.linalg.norm(hook.shift_m))], 1e-6)
    newtons = float(np.linalg.norm(before.reaction(state.x)))
    right = Expected(follows[:, None] * hook.shift_m, np.zeros(1), newtons)
    return _pulled(model, CutCase(body, cuts, [hook], np.empty((0, 3))), [right])


def _of_bar(cut: Cut, model: str) -> Answer:
    body = stage.bar_body(0)
    return _severed(model, body, [cut], _hook(body, [0.2, 0.025, 0.025], [0.01, 0.0, 0.004], 0.04))


def _held(model: str) -> Answer:
    return _of_bar(_plane([0.015, 0.025, 0.025], [1.0, 0.0, 0.0]), model)


def _crossing(model: str) -> Answer:
    """Cut a slab that is held at one end twice, so that of four pieces one is held, one pulled, and two are loose."""
    body, middle = _slab(held_at=0), [0.053, 0.051, 0.02]
    cuts = [_plane(middle, [1.0, 1.0, 0.1]), _plane(middle, [1.0, -1.0, 0.05])]
    return _severed(model, body, cuts, _hook(body, [0.1, 0.05, 0.02], [0.02, 0.0, 0.01], 0.02))


def _lobe(model: str) -> Answer:
    mesh = liver(0.2)
    held = np.flatnonzero(np.linalg.norm(mesh.nodes - [-0.03, 0.05, 0.03], axis=1) <= 0.04)
    body = nest("liver", mesh, 0, held, SOFT)
    hook = _hook(body, mesh.nodes[mesh.nodes[:, 0].argmax()], [0.01, 0.0, 0.005], 0.02)
    return _severed(model, body, [_plane([0.05, 0.0, 0.05], [1.0, 0.2, 0.1])], hook)


def _made(mesh: Mesh, beyond: np.ndarray, lips: np.ndarray) -> tuple[TetMesh, np.ndarray]:
    """Give elements ``beyond`` (m,) bool their own copies of the nodes ``lips`` (k,), by hand; and the copies (n,)."""
    copy = np.arange(len(mesh.nodes))
    copy[lips] = len(mesh.nodes) + np.arange(len(lips))
    tetrahedra = np.where(beyond[:, None], copy[mesh.tetrahedra], mesh.tetrahedra)
    return TetMesh(np.vstack([mesh.nodes, mesh.nodes[lips]]), tetrahedra), copy


def _by_hand(case: CutCase, lips: np.ndarray, order: int = 1, still: np.ndarray | None = None) -> Expected:
    """Solve the one cut of a case, along faces of the mesh, with scikit-fem and linear elasticity.

    lips : (k,) the nodes that have two sides; still : those of what nothing holds
    order : 2 for quadratic elements on the mesh halved once, with the pressure as an unknown (Taylor and Hood 1973)
    """
    import skfem
    from skfem.helpers import ddot, div, sym_grad

    (cut,), mesh, tissue = case.cuts, case.body.coarse, case.body.tissue(0)
    slit, copy = _made(mesh, cut.across(mesh.nodes[mesh.tetrahedra].mean(axis=1)) > 0.0, lips)
    meshes = [skfem.MeshTet(np.ascontiguousarray(slit.nodes.T), np.ascontiguousarray(slit.tetrahedra.T))]
    parts = 1
    if order == 2:
        meshes, parts = [*meshes, meshes[0].refined()], 8
    basis = skfem.Basis(meshes[-1], skfem.ElementVector(skfem.ElementTetP2() if order == 2 else skfem.ElementTetP1()))
    shear, lame = (
        np.outer(np.tile(each, parts), np.ones(basis.X.shape[1])) for each in (tissue.shear_pa, tissue.lame_pa)
    )
    strains = skfem.BilinearForm(lambda u, v, w: 2.0 * w.shear * ddot(sym_grad(u), sym_grad(v)))
    stiffness, unknowns = strains.assemble(basis, shear=shear), basis.nodal_dofs.T
    if order == 2:
        unknowns = np.vstack([unknowns, basis.edge_dofs.T])
        pressure = basis.with_element(skfem.ElementTetP1())
        coupling = skfem.BilinearForm(lambda u, q, w: -div(u) * q).assemble(basis, pressure)
        bulk = skfem.BilinearForm(lambda p, q, w: -p * q / w.lame).assemble(pressure, lame=lame)
        stiffness = skfem.bmat([[stiffness, coupling.T], [coupling, bulk]], "csc")
    else:
        volume = skfem.BilinearForm(lambda u, v, w: w.lame * div(u) * div(v))
        stiffness = stiffness + volume.assemble(basis, lame=lame)

    def of(nodes: np.ndarray) -> np.ndarray:
        """Return the unknowns (j, 3) of some nodes, and of what lies halfway between them."""
        own = np.isin(np.arange(len(slit.nodes)), nodes)
        for each in meshes:
            own = np.append(own, own[each.edges].all(axis=0))
        return unknowns[own[: len(unknowns)]]

    held = case.body.anchors[0] if still is None else np.union1d(case.body.anchors[0], still)
    hooked, found = [of(hook.patch.nodes_of(mesh)) for hook in case.hooks], np.zeros(stiffness.shape[0])
    for hook, each in zip(case.hooks, hooked, strict=True):
        found[each] = hook.shift_m
    given = np.concatenate([of(np.union1d(held, copy[held])), *hooked])
    free = np.setdiff1d(np.arange(len(found)), given)
    found = skfem.solve(*skfem.condense(stiffness, x=found, I=free))
    force = stiffness @ found
    forces = np.array([force[i].sum(axis=0) @ unit(h.shift_m) for i, h in zip(hooked, case.hooks, strict=True)])
    return _expected(case, copy, found[unknowns], forces)


def _expected(case: CutCase, copy: np.ndarray, moved: np.ndarray, force: np.ndarray) -> Expected:
    """Return what is seen of the motion (n, 3) [m] of a mesh that ``_made`` has made."""
    surface = case.body.fine.surface
    beyond = case.cuts[0].across(case.body.fine.nodes[surface]) >= 0.0
    return Expected(moved[np.where(beyond, copy[surface], surface)], force, float(np.linalg.norm(force)))


def _slab_case(cut: Cut, body: Body | None = None, shift_m: Sequence[float] = (0.0, SMALL_M, 0.0)) -> CutCase:
    """Pull the top of a slab apart on both sides of its middle."""
    body, way = body or _slab(), np.array(shift_m)
    hooks = [_hook(body, [0.05, 0.05 + y, SLAB_M[2]], np.sign(y) * way, 0.015) for y in (0.025, -0.025)]
    return CutCase(body, [cut], hooks, np.empty((0, 3)))


def _middle(mesh: Mesh, off_m: float = 0.0, turn_m: float = 0.0, deep_m: float = DEEP_M) -> Blade:
    """Cut a slab from one side to the other along its middle, ``off_m`` beside it, and ``turn_m`` askew."""
    path = np.array([[0.0, 0.05 + off_m - turn_m, SLAB_M[2]], [SLAB_M[0], 0.05 + off_m + turn_m, SLAB_M[2]]])
    return blade(mesh, path, DOWN, deep_m)


def _lips(mesh: Mesh, deep_m: float = DEEP_M, long_m: float = 1.0) -> np.ndarray:
    """Return the nodes of the middle's lips, to above the front."""
    x, y, z = mesh.nodes.T
    return np.flatnonzero((np.abs(y - 0.05) < 1e-6) & (z > SLAB_M[2] - deep_m + 1e-6) & (x < long_m))


def _of_slab(model: str, off_m: float = 0.0, turn_m: float = 0.0, deep_m: float = DEEP_M) -> Answer:
    mesh = _slab().coarse
    case = _slab_case(_middle(mesh, off_m, turn_m, deep_m))
    return _pulled(model, case, [_by_hand(case, _lips(mesh, deep_m))])


def _through(model: str) -> Answer:
    return _of_slab(model, NEAR_M, deep_m=10.0 * SLAB_M[2])


def _midway(model: str) -> Answer:
    mesh, stops = _slab().coarse, (4, 5)
    case = _slab_case(_middle(mesh, NEAR_M).up_to(0.5 * sum(stops) * CELL_M))
    return _pulled(model, case, [_by_hand(case, _lips(mesh, long_m=(n - 0.5) * CELL_M)) for n in stops])


def _nothing(model: str) -> Answer:
    mesh = _slab().coarse
    case = _slab_case(blade(mesh, np.array([[0.021, 0.0513, 0.04], [0.083, 0.0487, 0.04]]), DOWN, 0.0))
    return _pulled(model, case, [_by_hand(case, np.array([], dtype=int))])


def _flap(model: str) -> Answer:
    """Cut from a side of a slab below its skin and parallel to it, and lift the flap."""
    body, high = _slab(), SLAB_M[2] - 0.01
    mesh = body.coarse
    cut = blade(mesh, np.array([[0.0, 0.0, high - NEAR_M], [0.1, 0.0, high + NEAR_M]]), np.array([0.0, 1.0, 0.0]), 0.05)
    hooks = [_hook(body, [0.05, 0.0125, SLAB_M[2]], [0.0, 0.0, SMALL_M], 0.015)]
    _, y, z = mesh.nodes.T
    case = CutCase(body, [cut], hooks, np.empty((0, 3)))
    return _pulled(model, case, [_by_hand(case, np.flatnonzero((np.abs(z - high) < 1e-6) & (y < 0.05 - 1e-6)))])


def _prongs(model: str, poisson: float = SOFT.poisson, order: int = 1) -> Answer:
    """Cut a bar through its held end, along it to its middle, and bend it across the cut; ``order`` of ``_by_hand``."""
    body = stage.bar_body(0, replace(SOFT, poisson=poisson))
    x, y, _ = body.coarse.nodes.T
    path = np.array([[0.0, 0.025 + NEAR_M, 0.05], [0.1, 0.025 - NEAR_M, 0.05]])
    cut = replace(blade(body.coarse, path, DOWN, 0.06), open_ends=(True, True)).up_to(0.1)
    case = CutCase(body, [cut], [_hook(body, [0.2, 0.025, 0.025], [0.0, SMALL_M, 0.0], 0.04)], np.empty((0, 3)))
    lips = np.flatnonzero((np.abs(y - 0.025) < 1e-6) & (x < 0.1 - 1e-6))
    return _pulled(model, case, [_by_hand(case, lips, order)])


def _half(model: str) -> Answer:
    """Bend the held half of a severed bar; the other half stays where it is."""
    body = stage.bar_body(0)
    x = body.coarse.nodes[:, 0]
    hook = _hook(body, [0.05, 0.025, 0.05], [0.0, 0.0, SMALL_M], 0.026)
    case = CutCase(body, [_plane([0.1 + NEAR_M, 0.025, 0.025], [1.0, 0.0, 0.0])], [hook], np.empty((0, 3)))
    free = np.flatnonzero(x > 0.1 + 1e-6)
    return _pulled(model, case, [_by_hand(case, np.flatnonzero(np.abs(x - 0.1) < 1e-6), still=free)])


def _of_materials(model: str, along: int, young_pa: Sequence[float] = (1e3, 3e3, 3e4)) -> Answer:
    """Cut a slab in layers of several materials, one after the other along an axis."""
    mesh = _slab().coarse
    share = mesh.nodes[mesh.tetrahedra].mean(axis=1)[:, along] / SLAB_M[along]
    tissue = Tissue([replace(SOFT, young_pa=each) for each in young_pa], (len(young_pa) * share).astype(int))
    case = _slab_case(_middle(mesh, NEAR_M), _slab(tissue))
    return _pulled(model, case, [_by_hand(case, _lips(mesh))])


def _far(model: str, shift_m: float = 0.05) -> Answer:
    """Pull so far that linear elasticity has no say; the same mesh is made by hand, and its residual computed apart."""
    body = _slab()
    mesh = body.coarse
    case = _slab_case(_middle(mesh, NEAR_M), body, [0.0, shift_m, 0.0])
    slit, copy = _made(mesh, case.cuts[0].across(mesh.nodes[mesh.tetrahedra].mean(axis=1)) > 0.0, _lips(mesh))
    nodes = np.concatenate([hook.patch.nodes_of(mesh) for hook in case.hooks])
    ways = np.concatenate([np.tile(h.shift_m, (len(h.patch.nodes_of(mesh)), 1)) for h in case.hooks])
    order = np.argsort(nodes)
    problem = Grasping(nest("made", slit, 0, body.anchors[0], SOFT), 0, 1, Nodes(np.empty((0, 3, 3)), nodes[order]))
    (state,) = problem.push(ways[order] / shift_m, [shift_m], 1e-8)
    force = -LinearElements(slit, SOFT).force(state.x)
    if np.linalg.norm(np.delete(force, np.append(nodes, body.anchors[0]), axis=0)) > 1e-5 * np.linalg.norm(force):
        raise AssertionError("what is compared with is no equilibrium")
    forces = np.array([force[h.patch.nodes_of(mesh)].sum(axis=0) @ unit(h.shift_m) for h in case.hooks])
    return _pulled(model, case, [_expected(case, copy, state.x - slit.nodes, forces)])


def _outside(model: str) -> Answer:
    path = [[0.0, 0.2, 0.04], [0.1, 0.2, 0.04]]
    make_cut("cut", CutSettings(path_m=path, depth_m=0.01, direction=DOWN.tolist()), _slab().coarse)
    raise AssertionError("not refused")


def _weighs(model: str) -> Answer:
    body = part(stage.bar_body(0), 0, [_plane([0.12, 0.025, 0.025], [1.0, 0.3, 0.1])], VIRTUAL_NODES).body
    Equilibrium(body, 0).solve(np.full(body.coarse.nodes.shape, -1e-4) * [0.0, 0.0, 1.0], 1e-6)
    raise AssertionError("not refused")
