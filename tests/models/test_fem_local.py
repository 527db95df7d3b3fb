"""Elements that are fine near the contact only: what they answer where they are the body's own, and elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark.load import Load
from palpate.bodies.body import nest
from palpate.bodies.fine_surface_map import FineSurfaceMap
from palpate.bodies.local_refinement import LocalRefinement
from palpate.bodies.material import Material
from palpate.bodies.refinement import finer
from palpate.bodies.simple_shapes import box
from palpate.effects.patch_load import patch_at, patch_shares
from palpate.errors import InputError
from palpate.models.kinds import FEM, LocalFEM

FAR = 100.0


def ask(pressed, model):
    case, contact, force = pressed
    solver = model.prepare(case)
    solver.precede(Load.at(contact, force))
    return solver.respond(Load.at(contact, force))


def local(reach, order=1, **more):
    return LocalFEM(depth=1, reach=reach, order=order, **more or {"tolerance": 1e-9})


@pytest.mark.parametrize("order", [1, 2])
def test_refined_everywhere_it_answers_as_the_fine_level(pressed, order):
    case, contact, force = pressed
    fine = FEM(order=order, level=1, tolerance=1e-9).prepare(case).respond(Load.at(contact, force))
    found = ask(pressed, local(FAR, order))
    assert np.abs(found - fine).max() < 1e-7 * np.abs(fine).max()


def test_the_more_is_refined_the_softer_it_is(pressed):
    """Each mesh contains the displacements of the one before, so the work of the same small load can only grow."""
    case, contact, force = pressed
    small = 1e-3 * force
    nodes, shares = patch_shares(case.body.fine, patch_at(case.body, contact, case.radius_m))
    rows = np.searchsorted(case.body.fine.surface, nodes)
    levels = [FEM(order=1, level=level, tolerance=1e-9).prepare(case) for level in (0, 1)]
    refined = [local(reach).prepare(case) for reach in (0.0, 2.0)]
    answers = [solver.respond(Load.at(contact, small)) for solver in (levels[0], *refined, levels[1])]
    work = [float(shares @ answer[rows] @ small) for answer in answers]
    assert np.all(np.diff(work) > 1e-3 * work[-1])


@pytest.mark.parametrize("order", [1, 2])
def test_an_early_stop_begins_at_the_frame_before(pressed, order):
    end = ask(pressed, local(1.0, order))
    cold, warm = (ask(pressed, local(1.0, order, start=start, iterations=1)) for start in ("rest", "frame"))
    assert np.linalg.norm(warm - end) < 0.1 * np.linalg.norm(cold - end)


def test_settings_share_meshes_and_each_is_charged_for_them(pressed):
    case, _, force = pressed
    fresh = replace(case, body=replace(case.body), used={})
    first = local(1.0).prepare(fresh)
    fresh.used.clear()
    second = local(1.0, start="frame", iterations=1).prepare(fresh)
    assert first._meshes is second._meshes and fresh.used["meshes"] > 0.0
    assert set(first._meshes._made) == set(case.prepared_contacts.tolist())
    unprepared = np.setdiff1d(first._meshes._contacts, case.prepared_contacts)
    if len(unprepared):
        assert np.isfinite(first.respond(Load.at(unprepared[0], force))).all()
    with pytest.raises(InputError, match="not a free surface node"):
        first.respond(Load.at(case.body.anchors[0][0], force))


@pytest.fixture(scope="module", params=["straight", "moved"])
def whole(request):
    """A bar with three levels, once with new nodes moved away from the middles of edges."""
    coarse = box([0.2, 0.05, 0.05], [4, 1, 1])

    def swell(mesh, first):
        nodes = mesh.nodes.copy()
        nodes[first:] += 0.004 * np.sin(300.0 * nodes[first:])
        return type(mesh)(nodes, mesh.tetrahedra)

    held = np.flatnonzero(coarse.nodes[:, 0] == 0.0)
    return nest("bar", coarse, 2, held, Material(3000.0, 0.3, 1000.0), swell if request.param == "moved" else None)


def local_mesh(whole, radius):
    """The mesh that is fine around a node, and straight-sided places of the whole body's nodes."""
    center = whole.coarse.nodes[whole.coarse.surface[-1]]
    return LocalRefinement(whole, 2).around(center, radius), whole.prolongation @ whole.coarse.nodes


@pytest.mark.parametrize("radius", [0.0, 0.07])
def test_the_map_to_the_surface_is_linear_on_each_triangle(whole, radius):
    """Against an interpolation of the straight-sided mesh that knows nothing of levels."""
    local, straight = local_mesh(whole, radius)
    places, nodes = straight[local.numbers[-1]], straight[whole.fine.surface]
    values = np.random.default_rng(0).normal(size=len(places))
    found = FineSurfaceMap(whole).of(local, 1) @ values
    for node, value in list(zip(nodes, found, strict=True))[::7]:
        inside = []
        for triangle in local.fine.triangles:
            weights, *_ = np.linalg.lstsq(np.vstack([places[triangle].T, np.ones(3)]), [*node, 1.0], rcond=None)
            error = np.abs(weights @ places[triangle] - node).max()
            if weights.min() > -1e-9 and error < 1e-12:
                inside.append(weights @ values[triangle])
        assert inside and np.abs(np.array(inside) - value).max() < 1e-9


def test_the_map_of_quadratic_elements_follows_a_quadratic_field(whole):
    """On straight elements it is exact for polynomials of degree 2 of the straight places."""
    local, straight = local_mesh(whole, 0.03)
    corners = straight[local.numbers[-1]]
    unknowns = finer(local).prolongations[-1] @ corners

    def field(x):
        return x[:, 0] ** 2 + x[:, 1] * x[:, 2] - 3.0 * x[:, 2] + 1.0

    expected = field(straight[whole.fine.surface])
    assert FineSurfaceMap(whole).of(local, 2) @ field(unknowns) == pytest.approx(expected, abs=1e-13)
