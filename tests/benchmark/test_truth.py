"""The truth of a small body: its levels, its limit, its own error, and when it is not believed."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.accuracy import OWN, patch_nodes, truth_errors, truth_levels
from palpate.benchmark.presses import LOAD_COLUMNS, samples_in
from palpate.benchmark.richardson import limit
from palpate.benchmark.truth import objection, truth_of
from palpate.bodies.body import nest
from palpate.bodies.mesh import TetMesh
from palpate.bodies.refinement import finer
from palpate.bodies.supports import Bed
from palpate.errors import InputError
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.tradeoff.truth_table import other_element, truth_table, widened

RADIUS_M = 0.03


@pytest.fixture(scope="module")
def loads(slab):
    """A press and an oblique one, at nodes of the upper face away from the clamp."""
    top = slab.coarse.surface[np.argsort(slab.coarse.nodes[slab.coarse.surface] @ [0.3, 0.0, 1.0])[-2:]]
    rows = [(3, top[0], 0.0, 0.0, -0.3, RADIUS_M), (7, top[1], 0.1, 0.05, -0.2, RADIUS_M)]
    return pd.DataFrame(rows, columns=LOAD_COLUMNS)


@pytest.fixture(scope="module")
def slab_truth(slab, loads):
    return truth_of(slab, samples_in(loads), {3, 7})


@pytest.fixture(scope="module")
def block(box, soft):
    """A box of 12 coarse elements, refined once, held at one end."""
    mesh = box([2, 1, 1], [0.2, 0.1, 0.1])
    return nest("block", mesh, 1, np.flatnonzero(mesh.nodes[:, 0] == 0.0), soft)


@pytest.fixture(scope="module")
def corner(block):
    """A press on the block's far corner."""
    contact = block.coarse.surface[np.argmax(block.coarse.nodes[block.coarse.surface].sum(axis=1))]
    return pd.DataFrame([(0, contact, 0.0, 0.0, -0.4, 0.06)], columns=LOAD_COLUMNS)


@pytest.mark.slow
def test_levels_are_solved_to_less_than_can_be_seen(slab, loads, slab_truth):
    """Started from the level before, or from rest to a far smaller residual, answers agree to 0.002 % of the peak."""
    whole = finer(slab, 2)
    assert slab_truth.levels.shape == (2, 3, len(slab.fine.surface), 3) and slab_truth.level == 2
    assert slab_truth.elements == 64 * 96 and slab_truth.nodes == len(whole.fine.nodes)
    for row, sample in enumerate(samples_in(loads)):
        for level in (1, 2):
            solver = Equilibrium(whole, level, order=2)
            forces = sample.nodal(whole, level, order=2)
            cold = (solver.solve(forces, 1e-10).x - solver.mesh.nodes)[slab.fine.surface]
            peak = np.linalg.norm(cold, axis=1).max()
            assert np.abs(slab_truth.levels[row, level] - cold).max() < 2e-5 * peak


def test_its_own_error_is_that_which_finer_levels_find(block, corner):
    """In the models' denominators and on their nodes: all of it, or down to a fifth, as a change of limits is."""
    found, once = truth_of(block, samples_in(corner), {0}), finer(block)
    again = truth_of(once, samples_in(corner), {0}).displacement[0][
        np.searchsorted(once.fine.surface, block.fine.surface)
    ]
    patch = patch_nodes(block.fine, int(corner["contact"][0]), 0.06)
    error = truth_errors(found.displacement[0], again, patch)
    for name in ("rmse_of_peak", "relative_l2", "patch_rms_of_peak"):
        said = found.own[0, OWN.index(name)]
        assert 0.2 * said < getattr(error, name) < said < 0.01, name


def test_volume_lost_and_counts_are_those_of_its_levels(slab, loads, slab_truth):
    """By linear elements with the same nodes, instead of the surface around quadratic ones: to what facets leave."""
    solver = Equilibrium(finer(slab, 2), 2, order=2)
    mesh = solver.mesh
    forces = samples_in(loads)[0].nodal(finer(slab, 2), 2, order=2)
    x = solver.solve(forces, 1e-10).x
    corners = x[mesh.tetrahedra]
    filled = np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6.0
    lost = filled / mesh.volumes.sum() - 1.0
    assert lost < -1e-5 and slab_truth.volume_change[0] == pytest.approx(lost, rel=0.05)
    assert (slab_truth.iterations >= 3).all() and (slab_truth.products > slab_truth.iterations).all()


def test_another_element_has_the_same_limit(slab, loads, slab_truth):
    """Linear elements, many times as wrong on the same nodes, are half as wrong in their limit."""
    solver = Equilibrium(slab, 1)
    forces = samples_in(loads)[0].nodal(slab, 1)
    linear = (solver.solve(forces, 1e-8).x - solver.mesh.nodes)[slab.fine.surface]
    patch = patch_nodes(slab.fine, int(loads["contact"][0]), RADIUS_M)
    error = truth_errors(linear, slab_truth.displacement[0], patch).rmse_of_peak
    assert error > 20 * slab_truth.own[0, OWN.index("rmse_of_peak")]
    [row] = other_element(slab, samples_in(loads), slab_truth, [7]).itertuples()
    own = slab_truth.own[1, OWN.index("rmse_of_peak")]
    assert row.sample == 7 and row.rmse_of_peak < 0.6 * row.finest_rmse_of_peak < 4 * own
    assert 2.0 < row.ratio < 4.5


def test_own_errors_cover_what_another_element_finds(slab_truth):
    """By the factor of the means in every sample, and in those that were checked at least what was found."""
    column = OWN.index("rmse_of_peak")
    found = pd.DataFrame(3.0 * slab_truth.own[[1]], columns=list(OWN)).assign(sample=7)
    found["relative_l2"] = 0.0
    wide = widened(slab_truth, found)
    assert np.allclose(wide.own[:, column], 3.0 * slab_truth.own[:, column])
    nearer = OWN.index("relative_l2")
    assert np.array_equal(wide.own[:, nearer], slab_truth.own[:, nearer])
    assert widened(slab_truth, found.iloc[:0]) is slab_truth


def test_four_levels_where_a_body_has_them_and_three_for_who_does_without(slab, block, corner, soft, loads):
    twice = nest("twice", slab.coarse, 2, slab.anchors[0], soft)
    assert truth_levels(twice) == range(0, 4) and truth_levels(slab) == range(0, 3)
    small = nest("small", block.coarse, 2, block.anchors[0], soft)
    there = int(corner["contact"][0])
    found = truth_of(small, samples_in(loads.assign(contact=there, radius_m=0.06)), {3})
    assert np.isfinite(found.levels[0]).all() and np.isnan(found.levels[1, 3]).all() and found.level == 3
    first, second = (limit(found.levels[0][part]) for part in (slice(0, 3), slice(1, 4)))
    assert np.allclose(found.displacement[0], second)
    patch = patch_nodes(small.fine, there, 0.06)
    assert np.allclose(found.own[0], truth_errors(2 * second - first, second, patch))
    assert np.allclose(found.displacement[1], limit(found.levels[1][:3]))


def test_levels_of_another_shape_are_left_out(slab):
    """A body whose finest level was moved to a smooth surface has no coarser level of that shape."""
    nodes = slab.fine.nodes.copy()
    nodes[len(slab.coarse.nodes) :, 2] += 1e-3
    moved = replace(slab, levels=[slab.coarse, replace(slab.fine, nodes=nodes)])
    assert truth_levels(moved) == range(1, 4)


def test_what_is_not_believed_is_kept_with_its_reason_and_left_out(block, corner, slab_truth):
    assert slab_truth.rejected.tolist() == ["", ""] and slab_truth.rows([7, 3]).tolist() == [1, 0]
    with pytest.raises(InputError, match="sample 5 has no truth"):
        slab_truth.rows([3, 5])
    both = pd.concat([corner, corner.assign(sample=1, force_z_n=-40.0)])
    with pytest.warns(UserWarning, match=r"bodies\.block: 1 of 2 presses have no truth .* they are left out"):
        found = truth_of(block, samples_in(both), {0, 1})
    assert found.rejected[1] and not found.rejected[0] and found.rows([1, 0]).tolist() == [0]
    [row] = truth_table({"block_deep": found}).itertuples()
    assert (row.samples, row.rejected) == (1, 1)
    assert row.why_rejected.startswith(("1 no answer", "1 the levels", "1 an element", "1 the Hessian"))
    assert row.inverted == (found.least_det[1] <= 0.0)
    table = truth_table({"block_deep": replace(found, least_det=np.array([-0.1, -0.2]))})
    assert table["inverted"].item() == table["squeezed"].item() == 2  # whether they are believed or not
    assert row.rmse_of_peak == pytest.approx(found.own[0, OWN.index("rmse_of_peak")])


@pytest.mark.parametrize(
    ("rate", "own", "change", "believed"),
    [(3.0, 0.2, 0.2, True), (1.0, 0.02, 0.02, True), (2.0, 0.04, 0.02, False), (np.nan, 0.02, 0.04, False)],
)
def test_a_limit_is_believed_by_its_ratio_or_where_hardly_anything_changes(rate, own, change, believed):
    """Unless an element is inverted, or the Hessian was clamped."""
    assert (objection(rate, own, change, 0.9, False) == "") == believed
    assert objection(rate, own, change, -0.1, False) and objection(rate, own, change, 0.9, True)


@pytest.fixture(scope="module")
def bean(box, soft):
    """A bent ellipsoid of 10 cm, 96 coarse elements, as it is nailed below or lies on a bed there."""
    mesh = box([4, 2, 2], [2.0, 2.0, 2.0])
    centred = mesh.nodes - 1.0
    ball = centred * (np.abs(centred).max(axis=1) / np.linalg.norm(centred, axis=1).clip(1e-9))[:, None]
    nodes = ball * [0.05, 0.025, 0.02] + np.outer(6.0 * (0.05 * ball[:, 0]) ** 2, [0, 0, 1.0])
    mesh = TetMesh(nodes, mesh.tetrahedra)
    below = np.flatnonzero(nodes[:, 2] < nodes[:, 2].min() + 0.02)
    bed = Bed(np.array([0.0, 0.0, nodes[:, 2].min()]), 0.06, 6e5, np.array([0.0, 0.0, -1.0]))
    return nest("nailed", mesh, 1, below, soft), nest("bedded", mesh, 1, np.empty(0, dtype=int), soft, bed=bed)


def test_a_bed_gives_a_truth_and_nails_one_that_is_less_sure(bean):
    """The same press from above; at the nails' rim displacements grow with the root of the distance."""
    nailed, bedded = bean
    contact = int(bedded.coarse.surface[np.argmax(bedded.coarse.nodes[bedded.coarse.surface] @ [0.3, 0.0, 1.0])])
    press = pd.DataFrame([(0, contact, 0.0, 0.0, -0.1, 0.015)], columns=LOAD_COLUMNS)
    lying, held = (truth_of(body, samples_in(press), {0}) for body in (bedded, nailed))
    assert lying.rejected[0] == held.rejected[0] == ""
    rms = OWN.index("rmse_of_peak")
    assert lying.ratio[0] > 3.0 and lying.own[0, rms] < 0.01
    assert held.ratio[0] < lying.ratio[0] and held.own[0, rms] > lying.own[0, rms]
