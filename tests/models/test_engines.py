"""MuJoCo's flex bodies and Newton's soft ones, if installed: they end at the equilibrium of their own law."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import Load
from palpate.bodies.material import LAWS, Tissue
from palpate.effects.law import fault, law_of
from palpate.effects.laws import quadratic_neo_hookean
from palpate.errors import InputError, NotConverged
from palpate.models import model_registry
from palpate.models.kinds import FEM, MuJoCo, NewtonVBD
from palpate.studies.hard_cases import model_cases

RUNS = {"mujoco": MuJoCo(steps=30, iterations=200), "newton_vbd": NewtonVBD(steps=300, sweeps=20, step=2.0)}
SHORT = {"mujoco": MuJoCo(steps=1, iterations=5), "newton_vbd": NewtonVBD(steps=3, sweeps=2, step=2.0)}


def test_an_engine_that_is_not_installed_is_named(monkeypatch):
    monkeypatch.setattr(model_registry, "ENGINES", dict.fromkeys(RUNS, "no_such_package"))
    assert model_registry.absent() == ["mujoco", "newton_vbd"]
    assert "engines" in model_registry.unknown(["fem_p1", "newton_vbd"], {})
    assert model_registry.unknown(["fem_p1"], {}) == ""
    monkeypatch.setattr(model_cases, "ENGINES", model_registry.ENGINES)
    assert model_cases.engines() == []


def test_the_law_of_newton_is_a_law():
    """Its energy is the published one, but for a constant; ``fault`` checks derivatives and moduli."""
    law, mu, lam = law_of(quadratic_neo_hookean.__file__), 3.0, 5.0
    assert fault(law) == ""
    gradient, hessian, derivatives = np.empty(3), np.empty((3, 3)), np.empty(2)

    def published(s):
        return 0.5 * mu * (s @ s - 3.0) + 0.5 * (lam + mu) * (s.prod() - 1.0 - mu / (lam + mu)) ** 2

    for s in (np.array([1.4, 0.9, 0.5]), np.array([1.1, 0.7, -0.3])):
        found = quadratic_neo_hookean.shape(s, mu, gradient, hessian)
        found += quadratic_neo_hookean.volume(s.prod(), mu, lam, derivatives)
        assert found == pytest.approx(published(s) - published(np.ones(3)))


def converged(case, engine, load):
    """Return the equilibrium of the engine's law on the coarsest mesh."""
    law = engine.law if engine.law in LAWS else quadratic_neo_hookean.__file__
    body, regions = replace(case.body, material=replace(case.body.material, law=law)), case.body.regions
    if regions is not None:
        materials = tuple(replace(each, law=law) for each in regions.materials)
        body = replace(body, regions=replace(regions, materials=materials))
    return FEM(order=1, level=0, tolerance=1e-9).prepare(replace(case, body=body)).respond(load)


@pytest.mark.parametrize("name", RUNS)
def test_it_ends_at_the_equilibrium_of_its_law(name, slab_case, grid):
    pytest.importorskip(model_registry.ENGINES[name])
    engine = RUNS[name]
    case, test, _ = slab_case
    case = replace(case, radius_m=0.03)
    load = Load.at(test.contact[0], test.force[0])
    own = converged(case, engine, load)
    solver = engine.prepare(case)
    answer = solver.respond(load)
    assert errors(answer, own).rmse_of_peak < 1e-4
    assert np.array_equal(solver.respond(load), answer)
    few = SHORT[name].prepare(case)
    assert errors(few.respond(load), own).rmse_of_peak > 1e-3
    with pytest.raises(InputError, match="not a free surface node"):
        solver.respond(Load.at(case.body.anchors[0][0], np.ones(3)))
    assert {each.level for each in engine.tried(case, grid)} == {0, 1}


@pytest.mark.parametrize("name", RUNS)
def test_it_refuses_a_bed(name, slab_case):
    pytest.importorskip(model_registry.ENGINES[name])
    case = replace(slab_case[0], body=replace(slab_case[0].body, bed=object()))
    with pytest.raises(NotConverged, match="have no elastic bed"):
        RUNS[name].prepare(case)


def test_newton_has_regions_of_several_stiffnesses(slab_case):
    pytest.importorskip("newton")
    case, test, _ = slab_case
    soft, mesh = case.body.material, case.body.coarse
    hard = mesh.nodes[mesh.tetrahedra].mean(axis=1)[:, 0] < np.median(mesh.nodes[:, 0])
    tissue = Tissue((soft, replace(soft, young_pa=5.0 * soft.young_pa)), hard.astype(np.int64))
    several = replace(case, radius_m=0.03, body=replace(case.body, regions=tissue))
    engine, load = RUNS["newton_vbd"], Load.at(test.contact[0], test.force[0])
    answer = engine.prepare(several).respond(load)
    assert errors(answer, converged(several, engine, load)).rmse_of_peak < 1e-3
    assert errors(answer, converged(replace(case, radius_m=0.03), engine, load)).rmse_of_peak > 0.1
