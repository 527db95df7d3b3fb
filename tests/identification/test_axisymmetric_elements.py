"""Forces and stiffnesses of axisymmetric elements are derivatives; a patch is exact; nothing locks."""

import numpy as np
import pytest

from palpate.effects.law import evaluate, law_of
from palpate.identification.axisymmetric_elements import AxisymmetricElements, rings
from palpate.identification.slab_section import slab_section

LAWS = ("neo_hookean", "stable_neo_hookean", "corotational", "st_venant_kirchhoff", "exponential(4)")
SECTION = slab_section(2.0, 0.2, 1.5, 1.5, 4)


@pytest.mark.parametrize("law", LAWS)
def test_force_and_stiffness_are_derivatives_of_the_energy(law):
    """By central differences at a random deformation."""
    elements, rng = AxisymmetricElements(rings(*SECTION[:2]), law_of(law), 1.0, 0.45), np.random.default_rng(0)
    small = np.minimum(1.0, np.linalg.norm(SECTION.nodes, axis=1, keepdims=True) / 0.2)
    x = (SECTION.nodes + 0.002 * small * rng.standard_normal(SECTION.nodes.shape)) * [1.0, 0.9]
    way, step, quads = rng.standard_normal(x.shape), 1e-6, elements.mesh.quads
    more, less = (elements.linearise(x + sign * step * way) for sign in (1.0, -1.0))
    _, force, stiffness = elements.linearise(x)
    assert (more[0] - less[0]) / (2.0 * step) == pytest.approx(float((force * way).sum()), rel=1e-6)
    product = np.zeros_like(x)
    np.add.at(product, quads, np.einsum("mij,mj->mi", stiffness, way[quads].reshape(len(quads), -1)).reshape(-1, 9, 2))
    assert np.abs(product - (more[1] - less[1]) / (2.0 * step)).max() < 1e-7 * np.abs(product).max()


@pytest.mark.parametrize("law", LAWS)
def test_a_homogeneous_stretch_has_the_energy_of_the_law(law):
    mesh = rings(*SECTION[:2])
    elements = AxisymmetricElements(mesh, law_of(law), 1.0, 0.3)
    energy, force, _ = elements.linearise(mesh.nodes * [1.1, 0.8])
    mu, lam = 1.0 / 2.6, 0.3 / (1.3 * 0.4)
    assert energy == pytest.approx(mesh.volumes.sum() * evaluate(law_of(law), [1.1, 1.1, 0.8], mu, lam)[0], rel=1e-12)
    inner = np.setdiff1d(np.arange(len(force)), np.concatenate([SECTION.surface, SECTION.held]))
    assert np.abs(force[inner]).max() < 1e-10
