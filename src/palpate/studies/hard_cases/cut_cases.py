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
from palpate.studies.hard_cases.fem_cases import taylor_hood
from palpate.studies.hard_cases.stage import SOFT, Answer, Case, refuses

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
"""Function from a case to the model that is prepared for its cuts, by name."""
SAME = tuple(MODELS)[:7]
"""Models whose limit, where a cut runs along faces of the mesh, is the equilibrium of linear elements on it."""
EXACT = tuple(name for name in SAME if name != "xpbd")
"""Those of SAME that converge within the iterations that they are given here."""
NEAR_M = 1e-9
"""Distance [m] of a cut from nodes, edges and faces; places as near to it belong to either lip."""
DOWN = np.array([0.0, 0.0, -1.0])
SLAB_M, CELL_M = (0.1, 0.1, 0.04), 0.0125
OBLIQUE, DIAGONAL = np.array([1.0, 0.31, 0.17]), np.array([1.0, 1.0, 0.0])
DEEP_M = 0.02
"""Depth [m] of cuts of the slab: two of its four layers."""
SMALL_M = 1e-4
"""Displacement [m] of hooks where the independent answer is linear elasticity."""
SEVERED = "error of the surface's motion over that of theory, or a hook's force over what it was before the cut"
MADE = "L2 error of the surface's motion, or of the hooks' forces, from scikit-fem's on a mesh that was made so"


@dataclass(frozen=True, eq=False)
class Expected:
    """The expected result of a pull.

    displacement : (n, 3) [m] of the body's surface nodes; force : (h,) [N] on each hook along its motion
    force_scale : [N] that errors of ``force`` are divided by
    """

    displacement: np.ndarray
    force: np.ndarray
    force_scale: float


def cases() -> list[Case]:
    def severed(name: str, scene: str, run: Callable[[str], Answer], **more: Any) -> Case:
        bounds = {"vertex_block_descent": 0.04, "xpbd": 0.04} | more.pop("bounds", {})
        return Case(f"cut_{name}", scene, "the piece follows its hook without a force; what is held or loose stays",
                    SEVERED, 1e-4, run, tuple(MODELS), bounds=bounds, **more)  # fmt: skip

    def made(name: str, scene: str, run: Callable[[str], Answer], models: Sequence[str] = EXACT, **more: Any) -> Case:
        expected = more.pop("expected", "the answer of the same mesh, made with two lips by hand")
        return Case(f"cut_{name}", scene, expected, MADE, more.pop("bound", 0.004), run, models, **more)

    loose, refused = {CONFORMING: ("refused",)}, ("refused",)
    near = "a cut severs a bar, {} m beside {}"
    middle = np.array([0.1, 0.025, 0.025])
    return [
        severed("near_nodes", near.format(f"{NEAR_M:g}", "a node that it would meet at an angle"),
                partial(_of_bar, _plane(middle + NEAR_M * unit(OBLIQUE), OBLIQUE))),
        severed("near_edges", near.format(f"{NEAR_M:g}", "the edges that are diagonals of its cells"),
                partial(_of_bar, _plane(middle - NEAR_M * unit(DIAGONAL), DIAGONAL))),
        made("near_faces", f"a cut of a slab's top, {3 * NEAR_M:g} m askew to faces that it runs along",
             partial(_of_slab, off_m=NEAR_M, askew_m=2.0 * NEAR_M), SAME, bounds={"xpbd": 0.04}),
        severed("two_that_cross", "two cuts cross in a slab: of four pieces one is held, one is pulled, two are loose",
                _crossing, declared=loose | {"springs_deleted": ("wrong",)}),
        severed("along_held", "a cut along the held end of a bar, within the first layer of elements",
                partial(_of_bar, _plane([0.015, 0.025, 0.025], [1.0, 0.0, 0.0])), declared={REMOVED: ("wrong",)}),
        made("through_held", "a cut through the held end of a bar, to its middle; the bar is bent", _prongs, SAME,
             bounds={"xpbd": 0.045}),
        made("free_piece", "a severed bar whose held half is bent, while nothing holds or pulls the other", _half,
             (*EXACT, CONFORMING), declared=loose, expected="the held half is a bar of its own, and the other stays"),
        Case("cut_free_piece_weighs", "gravity acts on both halves of a severed bar", "refused: nothing holds one",
             SEVERED, 0.0, refuses(_weigh_severed_bar), ("statics",), refused),
        made("slivers", "a cut a hundredth of an edge beside faces, which leaves slices of a layer of elements",
             partial(_of_slab, off_m=0.01 * CELL_M), bound=0.01, declared={REMOVED: ("wrong",)}),
        made("stops_midway", "a blade that stops in the middle of elements", _midway, bound=0.03,
             expected="the answer of a mesh that was made for a blade at one or the other end of these elements"),
        made("without_area", "a cut without depth", _without_area, expected="the answer of the whole body"),
        Case("cut_outside", "a cut beside the body", "refused", SEVERED, 0.0, refuses(_cut_outside), ("blade",),
             refused),
        made("deeper_than_body", "a blade that is ten times as long as the slab is high",
             partial(_of_slab, off_m=NEAR_M, depth_m=10.0 * SLAB_M[2])),
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
    """Let a model cut and pull; the error is that of motion and forces from the nearest of the ``expected`` results."""
    prepared = MODELS[model](case)
    prepared.cut(case.cuts)
    pulled, surface = prepared.pull(), case.body.fine.nodes[case.body.fine.surface]
    # places within NEAR_M of a cut are on both lips
    on_one_lip = np.all([np.abs(cut.across(surface)) > 10.0 * NEAR_M for cut in case.cuts], axis=0)
    hook_count, values = len(case.hooks), np.append(pulled.displacement[on_one_lip].ravel(), pulled.force)

    def error_from(answer: np.ndarray, result: Expected) -> float:
        displacement = result.displacement[on_one_lip]
        motion_error = np.linalg.norm(answer[:-hook_count].reshape(-1, 3) - displacement) / np.linalg.norm(displacement)
        return float(max(motion_error, np.linalg.norm(answer[-hook_count:] - result.force) / result.force_scale))

    return Answer(values, np.zeros_like(values), lambda answer: min(error_from(answer, result) for result in expected))


def _hook(body: Body, at_m: Sequence[float], shift_m: Sequence[float], radius_m: float) -> Hook:
    """Put a hook on the disc around the surface node nearest to ``at_m`` (3,) [m], to be moved by ``shift_m`` (3,)."""
    surface = body.fine.surface
    node = surface[np.linalg.norm(body.fine.nodes[surface] - at_m, axis=1).argmin()]
    return Hook(patch_around(body.fine, int(node), radius_m), np.array(shift_m))


def _plane(point_m: Sequence[float] | np.ndarray, normal: Sequence[float] | np.ndarray) -> Disc:
    return Disc(np.array(point_m), unit(np.array(normal)), 1.0)


def _slab(tissue: Material | Tissue = SOFT, held_at: int = 2) -> Body:
    """Make a slab in cells of CELL_M, held where the coordinate ``held_at`` is 0, by default at its bottom."""
    mesh = box(list(SLAB_M), [8, 8, 4])
    held = np.flatnonzero(mesh.nodes[:, held_at] == 0.0)
    if isinstance(tissue, Tissue):
        return nest("slab", mesh, 0, held, SOFT, regions=tissue)
    return nest("slab", mesh, 0, held, tissue)


def _severed(model: str, body: Body, cuts: Sequence[Cut], hook: Hook) -> Answer:
    """Pull the piece on the positive side of all ``cuts``, which has to follow its hook without a force."""
    nodes = body.fine.nodes[body.fine.surface]
    on_piece = np.all([cut.across(nodes) >= 0.0 for cut in cuts], axis=0)
    uncut = Grasping(body, 0, 1, hook.patch)
    (state,) = uncut.push(unit(hook.shift_m), [float(np.linalg.norm(hook.shift_m))], 1e-6)
    force_scale = float(np.linalg.norm(uncut.reaction(state.x)))
    result = Expected(on_piece[:, None] * hook.shift_m, np.zeros(1), force_scale)
    return _pulled(model, CutCase(body, cuts, [hook], np.empty((0, 3))), [result])


def _of_bar(cut: Cut, model: str) -> Answer:
    """Sever a bar by ``cut``, and pull its free end."""
    body = stage.bar_body(0)
    return _severed(model, body, [cut], _hook(body, [0.2, 0.025, 0.025], [0.01, 0.0, 0.004], 0.04))


def _crossing(model: str) -> Answer:
    """Cut a slab twice, so that of four pieces one is held, one pulled, and two are loose."""
    body, middle = _slab(held_at=0), [0.053, 0.051, 0.02]
    cuts = [_plane(middle, [1.0, 1.0, 0.1]), _plane(middle, [1.0, -1.0, 0.05])]
    return _severed(model, body, cuts, _hook(body, [0.1, 0.05, 0.02], [0.02, 0.0, 0.01], 0.02))


def _lobe(model: str) -> Answer:
    """Sever a lobe of the shipped liver, and pull it."""
    body = stage.shipped_liver()
    hook = _hook(body, body.fine.nodes[body.fine.nodes[:, 0].argmax()], [0.01, 0.0, 0.005], 0.02)
    return _severed(model, body, [_plane([0.05, 0.0, 0.05], [1.0, 0.2, 0.1])], hook)


def _made(mesh: Mesh, beyond: np.ndarray, lips: np.ndarray) -> tuple[TetMesh, np.ndarray]:
    """Slit a mesh by hand: elements in the mask ``beyond`` (m,) get their own copies of the nodes ``lips`` (k,).

    Returns the slit mesh and, for each node (n,) of ``mesh``, the number of its copy, or its own number without one.
    """
    copy = np.arange(len(mesh.nodes))
    copy[lips] = len(mesh.nodes) + np.arange(len(lips))
    tetrahedra = np.where(beyond[:, None], copy[mesh.tetrahedra], mesh.tetrahedra)
    return TetMesh(np.vstack([mesh.nodes, mesh.nodes[lips]]), tetrahedra), copy


def _by_hand(case: CutCase, lips: np.ndarray, order: int = 1, still: np.ndarray | None = None) -> Expected:
    """Solve the one cut of a case, along faces of the mesh, by linear elasticity with scikit-fem on the slit mesh.

    lips : (k,) nodes of ``mesh`` that the cut doubles; still : nodes of a piece that nothing holds, kept at rest
    order : 1 for linear elements; 2 for the Taylor–Hood elements of ``taylor_hood`` on the slit mesh, refined once
    """
    import skfem
    from skfem.helpers import ddot, div, sym_grad

    (cut,), mesh, tissue = case.cuts, case.body.coarse, case.body.tissue(0)
    slit, copy = _made(mesh, cut.across(mesh.nodes[mesh.tetrahedra].mean(axis=1)) > 0.0, lips)
    meshes = [skfem.MeshTet(np.ascontiguousarray(slit.nodes.T), np.ascontiguousarray(slit.tetrahedra.T))]
    if order == 2:
        meshes.append(meshes[0].refined())
        basis, stiffness = taylor_hood(meshes[-1], np.tile(tissue.shear_pa, 8), np.tile(tissue.lame_pa, 8))
        unknowns = np.vstack([basis.nodal_dofs.T, basis.edge_dofs.T])
    else:
        basis = skfem.Basis(meshes[-1], skfem.ElementVector(skfem.ElementTetP1()))
        ones = np.ones(basis.X.shape[1])
        shear, lame = np.outer(tissue.shear_pa, ones), np.outer(tissue.lame_pa, ones)
        strains = skfem.BilinearForm(lambda u, v, w: 2.0 * w.shear * ddot(sym_grad(u), sym_grad(v)))
        volume = skfem.BilinearForm(lambda u, v, w: w.lame * div(u) * div(v))
        stiffness = strains.assemble(basis, shear=shear) + volume.assemble(basis, lame=lame)
        unknowns = basis.nodal_dofs.T

    def unknowns_of(nodes: np.ndarray) -> np.ndarray:
        """Return the unknowns (j, 3) of some nodes, and of the nodes halfway between two of them."""
        chosen = np.isin(np.arange(len(slit.nodes)), nodes)
        for each in meshes:
            chosen = np.append(chosen, chosen[each.edges].all(axis=0))
        return unknowns[chosen[: len(unknowns)]]

    held = case.body.anchors[0] if still is None else np.union1d(case.body.anchors[0], still)
    hook_unknowns = [unknowns_of(hook.patch.nodes_of(mesh)) for hook in case.hooks]
    u = np.zeros(stiffness.shape[0])
    for hook, each in zip(case.hooks, hook_unknowns, strict=True):
        u[each] = hook.shift_m
    prescribed = np.concatenate([unknowns_of(np.union1d(held, copy[held])), *hook_unknowns])
    u = skfem.solve(*skfem.condense(stiffness, x=u, I=np.setdiff1d(np.arange(len(u)), prescribed)))
    force = stiffness @ u
    forces = np.array([force[i].sum(axis=0) @ unit(h.shift_m) for i, h in zip(hook_unknowns, case.hooks, strict=True)])
    return _expected(case, copy, u[unknowns], forces)


def _expected(case: CutCase, copy: np.ndarray, displacement: np.ndarray, force: np.ndarray) -> Expected:
    """Return the expected result on the body's surface from the displacement (n, 3) [m] of the slit mesh."""
    surface = case.body.fine.surface
    beyond = case.cuts[0].across(case.body.fine.nodes[surface]) >= 0.0
    return Expected(displacement[np.where(beyond, copy[surface], surface)], force, float(np.linalg.norm(force)))


def _slab_case(cut: Cut, body: Body | None = None, shift_m: Sequence[float] = (0.0, SMALL_M, 0.0)) -> CutCase:
    """Describe a slab whose top two hooks pull apart, one by ``shift_m`` (3,) [m] and the other by its opposite."""
    body, shift = body or _slab(), np.array(shift_m)
    hooks = [_hook(body, [0.05, 0.05 + y, SLAB_M[2]], np.sign(y) * shift, 0.015) for y in (0.025, -0.025)]
    return CutCase(body, [cut], hooks, np.empty((0, 3)))


def _middle_cut(mesh: Mesh, off_m: float = 0.0, askew_m: float = 0.0, depth_m: float = DEEP_M) -> Blade:
    """Cut a slab's top along its middle plane, ``off_m`` [m] beside it, and at its ends ``askew_m`` [m] off that."""
    y = 0.05 + off_m
    path = np.array([[0.0, y - askew_m, SLAB_M[2]], [SLAB_M[0], y + askew_m, SLAB_M[2]]])
    return blade(mesh, path, DOWN, depth_m)


def _lips(mesh: Mesh, depth_m: float = DEEP_M, end_m: float = 1.0) -> np.ndarray:
    """Return the nodes that a cut of the middle plane doubles: above its front, and before x = ``end_m`` [m]."""
    x, y, z = mesh.nodes.T
    return np.flatnonzero((np.abs(y - 0.05) < 1e-6) & (z > SLAB_M[2] - depth_m + 1e-6) & (x < end_m))


def _of_slab(model: str, off_m: float = 0.0, askew_m: float = 0.0, depth_m: float = DEEP_M) -> Answer:
    """Cut a slab by ``_middle_cut``, and pull its lips apart."""
    mesh = _slab().coarse
    case = _slab_case(_middle_cut(mesh, off_m, askew_m, depth_m))
    return _pulled(model, case, [_by_hand(case, _lips(mesh, depth_m))])


def _midway(model: str) -> Answer:
    """Cut a slab to the middle of a layer of elements; either end of the layer is an expected end of the lips."""
    mesh, cell_ends = _slab().coarse, (4, 5)
    case = _slab_case(_middle_cut(mesh, NEAR_M).up_to(0.5 * sum(cell_ends) * CELL_M))
    return _pulled(model, case, [_by_hand(case, _lips(mesh, end_m=(cells - 0.5) * CELL_M)) for cells in cell_ends])


def _without_area(model: str) -> Answer:
    """Cut a slab by a blade without depth, which leaves it whole."""
    mesh = _slab().coarse
    case = _slab_case(blade(mesh, np.array([[0.021, 0.0513, 0.04], [0.083, 0.0487, 0.04]]), DOWN, 0.0))
    return _pulled(model, case, [_by_hand(case, np.array([], dtype=int))])


def _flap(model: str) -> Answer:
    """Cut a slab from one side, parallel to its top and below it, and lift the flap."""
    body, high = _slab(), SLAB_M[2] - 0.01
    mesh = body.coarse
    cut = blade(mesh, np.array([[0.0, 0.0, high - NEAR_M], [0.1, 0.0, high + NEAR_M]]), np.array([0.0, 1.0, 0.0]), 0.05)
    hooks = [_hook(body, [0.05, 0.0125, SLAB_M[2]], [0.0, 0.0, SMALL_M], 0.015)]
    _, y, z = mesh.nodes.T
    case = CutCase(body, [cut], hooks, np.empty((0, 3)))
    return _pulled(model, case, [_by_hand(case, np.flatnonzero((np.abs(z - high) < 1e-6) & (y < 0.05 - 1e-6)))])


def _prongs(model: str, poisson: float = SOFT.poisson, order: int = 1) -> Answer:
    """Cut a bar lengthwise from its held end to its middle, and bend it across the cut; order : as of ``_by_hand``."""
    body = stage.bar_body(0, replace(SOFT, poisson=poisson))
    x, y, _ = body.coarse.nodes.T
    path = np.array([[0.0, 0.025 + NEAR_M, 0.05], [0.1, 0.025 - NEAR_M, 0.05]])
    cut = replace(blade(body.coarse, path, DOWN, 0.06), open_ends=(True, True)).up_to(0.1)
    case = CutCase(body, [cut], [_hook(body, [0.2, 0.025, 0.025], [0.0, SMALL_M, 0.0], 0.04)], np.empty((0, 3)))
    lips = np.flatnonzero((np.abs(y - 0.025) < 1e-6) & (x < 0.1 - 1e-6))
    return _pulled(model, case, [_by_hand(case, lips, order)])


def _half(model: str) -> Answer:
    """Bend the held half of a severed bar, while the other half stays at rest."""
    body = stage.bar_body(0)
    x = body.coarse.nodes[:, 0]
    hook = _hook(body, [0.05, 0.025, 0.05], [0.0, 0.0, SMALL_M], 0.026)
    case = CutCase(body, [_plane([0.1 + NEAR_M, 0.025, 0.025], [1.0, 0.0, 0.0])], [hook], np.empty((0, 3)))
    free = np.flatnonzero(x > 0.1 + 1e-6)
    return _pulled(model, case, [_by_hand(case, np.flatnonzero(np.abs(x - 0.1) < 1e-6), still=free)])


def _of_materials(model: str, along: int, young_pa: Sequence[float] = (1e3, 3e3, 3e4)) -> Answer:
    """Cut a slab of layers of equal thickness along the axis ``along``, whose Young's moduli are ``young_pa``."""
    mesh = _slab().coarse
    relative = mesh.nodes[mesh.tetrahedra].mean(axis=1)[:, along] / SLAB_M[along]
    tissue = Tissue([replace(SOFT, young_pa=each) for each in young_pa], (len(young_pa) * relative).astype(int))
    case = _slab_case(_middle_cut(mesh, NEAR_M), _slab(tissue))
    return _pulled(model, case, [_by_hand(case, _lips(mesh))])


def _far(model: str) -> Answer:
    """Pull the lips of a cut far apart, and compare with the equilibrium of the mesh that is slit by hand."""
    body, shift_m = _slab(), 0.05
    mesh = body.coarse
    case = _slab_case(_middle_cut(mesh, NEAR_M), body, [0.0, shift_m, 0.0])
    slit, copy = _made(mesh, case.cuts[0].across(mesh.nodes[mesh.tetrahedra].mean(axis=1)) > 0.0, _lips(mesh))
    hooked = np.concatenate([hook.patch.nodes_of(mesh) for hook in case.hooks])
    shifts = np.concatenate([np.tile(h.shift_m, (len(h.patch.nodes_of(mesh)), 1)) for h in case.hooks])
    by_node = np.argsort(hooked)
    problem = Grasping(nest("made", slit, 0, body.anchors[0], SOFT), 0, 1, Nodes(np.empty((0, 3, 3)), hooked[by_node]))
    (state,) = problem.push(shifts[by_node] / shift_m, [shift_m], 1e-8)
    force = -LinearElements(slit, SOFT).force(state.x)
    if np.linalg.norm(np.delete(force, np.append(hooked, body.anchors[0]), axis=0)) > 1e-5 * np.linalg.norm(force):
        raise AssertionError("what is compared with is no equilibrium")
    forces = np.array([force[h.patch.nodes_of(mesh)].sum(axis=0) @ unit(h.shift_m) for h in case.hooks])
    return _pulled(model, case, [_expected(case, copy, state.x - slit.nodes, forces)])


def _cut_outside() -> None:
    path = [[0.0, 0.2, 0.04], [0.1, 0.2, 0.04]]
    make_cut("cut", CutSettings(path_m=path, depth_m=0.01, direction=DOWN.tolist()), _slab().coarse)


def _weigh_severed_bar() -> None:
    body = part(stage.bar_body(0), 0, [_plane([0.12, 0.025, 0.025], [1.0, 0.3, 0.1])], VIRTUAL_NODES).body
    Equilibrium(body, 0).solve(np.full(body.coarse.nodes.shape, -1e-4) * [0.0, 0.0, 1.0], 1e-6)
