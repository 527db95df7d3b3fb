"""MuJoCo's flex bodies, if it is installed: they end at the equilibrium of their own law on the same mesh."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.evaluation.accuracy import errors
from palpate.models import fem, model_registry
from palpate.models.load import Load

RUN = {"level": 0, "steps": 30, "iterations": 200}


def test_an_engine_that_is_not_installed_is_named(monkeypatch):
    monkeypatch.setitem(model_registry.ENGINES, "mujoco", "no_such_package")
    assert model_registry.absent() == ["mujoco"]
    assert "engines" in model_registry.unknown(["fem_p1", "mujoco"], {})
    assert model_registry.unknown(["fem_p1"], {}) == ""


def test_it_ends_at_the_equilibrium_of_its_law(slab_case):
    pytest.importorskip("mujoco")
    from palpate.models import mujoco_flex

    case, test, _ = slab_case
    case = replace(case, radius_m=0.03)
    law = replace(case.body.material, law="st_venant_kirchhoff")
    load = Load.at(test.contact[0], test.force[0])
    own = fem.prepare(
        replace(case, body=replace(case.body, material=law)), {"level": 0, "start": "rest", "tolerance": 1e-9}, 1
    ).respond(load)
    solver = mujoco_flex.prepare(case, RUN)
    assert errors(solver.respond(load), own).rmse_of_peak < 1e-4
    assert np.array_equal(solver.respond(load), solver.respond(load))
    few = mujoco_flex.prepare(case, RUN | {"steps": 1, "iterations": 5})
    assert errors(few.respond(load), own).rmse_of_peak > 1e-3
    with pytest.raises(InputError, match="not a free surface node"):
        solver.respond(Load.at(case.body.anchors[0][0], np.ones(3)))
    case = replace(case, grid={"mujoco_flex": {"runs": [RUN, RUN | {"level": 5}]}})
    assert mujoco_flex.settings(case) == [RUN]
