"""Each law against its formula in F, differences, and solutions of its own, in linear, quadratic and mean elements."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import polar
from scipy.optimize import brentq

from palpate.bodies.material import NAMED, Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.refinement import refine
from palpate.effects.law import evaluate, fault, law_of
from palpate.effects.laws import quadratic_neo_hookean
from palpate.effects.linear_elements import LinearElements
from palpate.effects.quadratic_elements import MeanDilatation, QuadraticElements
from palpate.errors import InputError, NotConverged

MU, LAM = 1100.0, 1700.0
ELEMENTS = {"linear": LinearElements, "quadratic": QuadraticElements, "mean": MeanDilatation}
SKEW = np.array([[1.0, 0.1, 0.2], [0.0, 1.0, 0.1], [-0.1, 0.0, 1.0]])
AFFINE = np.array([[1.2, 0.1, -0.05], [0.0, 0.9, 0.15], [0.1, -0.1, 1.1]])
STRETCHES = ([1.0, 1.0, 1.0], [1.3, 1.1, 0.7], [1.1, 1.1, 0.6], [0.5, 0.3, 0.2], [1.00001, 1.0, 0.99999])
STIFFENING = 8.0
"""That of the exponential law in NAMED."""
FORBIDS = ("neo_hookean", NAMED[-1])
"""Laws that do not let elements become flat."""


def density(law, f, mu, lam):
    """Ψ(F) by the formula of each law's paper."""
    i, j = np.sum(f**2), np.linalg.det(f)
    if law == "corotational":
        strain = polar(f)[1] - np.eye(3)
        return mu * np.sum(strain**2) + lam / 2 * np.trace(strain) ** 2
    if law == "st_venant_kirchhoff":
        green = (f.T @ f - np.eye(3)) / 2
        return mu * np.sum(green**2) + lam / 2 * np.trace(green) ** 2
    if law == "neo_hookean":
        return mu / 2 * (i - 3) - mu * np.log(j) + lam / 2 * np.log(j) ** 2
    if law == NAMED[-1]:
        exponent = STIFFENING * (i - 3 - 2 * np.log(j))
        return mu / (2 * STIFFENING) * (np.exp(exponent) - 1) + lam / 2 * np.log(j) ** 2
    m, stiff = 4 / 3 * mu, lam + 5 / 6 * mu  # Smith, de Goes, Kim 2018, eq. 14
    alpha = 1 + m / stiff - m / (4 * stiff)
    energy = m / 2 * (i - 3) + stiff / 2 * (j - alpha) ** 2 - m / 2 * np.log(i + 1)
    return energy - (stiff / 2 * (1 - alpha) ** 2 - m / 2 * np.log(4))


def stress(law, f, mu, lam):
    """∂Ψ/∂F of ``density``, by differences of the fourth order."""
    p, h = np.empty((3, 3)), 1e-3
    for a in range(3):
        for b in range(3):
            step = np.zeros((3, 3))
            step[a, b] = h
            at = [density(law, f + k * step, mu, lam) for k in (-2, -1, 1, 2)]
            p[a, b] = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * h)
    return p


def block(box, kind, law, poisson=0.3, counts=(1, 1, 1)):
    """A skew box: the nodes at rest, and its elements of one law."""
    mesh = box(list(counts), [0.1, 0.1, 0.1])
    mesh = TetMesh(mesh.nodes @ SKEW, mesh.tetrahedra)
    rest = mesh if kind == "linear" else refine(mesh)[0]
    return rest, ELEMENTS[kind](mesh, Material(3000.0, poisson, 1000.0, law))


def crumpled(mesh, rotation, amount):
    return mesh.nodes @ rotation(2.0).T + amount * 0.05 * np.random.default_rng(3).normal(size=mesh.nodes.shape)


@pytest.mark.parametrize("law", NAMED)
def test_energy_is_that_of_the_paper(law, rotation):
    for s in (*STRETCHES, [3.0, 0.9, 0.4]):
        expected = density(law, rotation(1.0) @ np.diag(s) @ rotation(2.0).T, MU, LAM)
        assert evaluate(law_of(law), s, MU, LAM)[0] == pytest.approx(expected, rel=1e-11, abs=1e-12 * MU)


@pytest.mark.parametrize("law", NAMED)
def test_slopes_and_curvatures_are_derivatives(law):
    for s in STRETCHES:
        _, gradient, hessian = evaluate(law_of(law), s, MU, LAM)
        for k, step in enumerate(1e-6 * np.eye(3)):
            more, less = (evaluate(law_of(law), s + sign * step, MU, LAM) for sign in (1.0, -1.0))
            assert (more[0] - less[0]) / 2e-6 == pytest.approx(gradient[k], rel=1e-8, abs=1e-6 * MU)
            assert np.abs((more[1] - less[1]) / 2e-6 - hessian[k]).max() < 1e-6 * np.abs(hessian).max()


@pytest.mark.parametrize("law", NAMED)
def test_shape_is_without_stress_at_rest_and_volume_too(law):
    """So that mean dilatation, which averages the one and not the other, is at rest the same for all."""
    functions, gradient, hessian, derivatives = law_of(law), np.empty(3), np.empty((3, 3)), np.empty(2)
    assert functions.shape(np.ones(3), MU, gradient, hessian) == 0.0
    assert np.abs(gradient).max() < 1e-12 * MU
    theta = functions.measure(np.ones(3), gradient, hessian)
    assert functions.volume(theta, MU, LAM, derivatives) == 0.0 and derivatives[0] == 0.0
    assert gradient == pytest.approx(np.ones(3)) and derivatives[1] == pytest.approx(LAM)


@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.499])
def test_all_laws_are_the_same_at_rest_and_positive_there(box, kind, poisson):
    rest, first = block(box, kind, NAMED[0], poisson)
    expected = first.stiffness(rest.nodes).toarray()
    values = np.linalg.eigvalsh(expected)
    assert (values[:6] < 1e-10 * values[-1]).all() and values[6] > 1e-6 * values[-1] * (1 - 2 * poisson)
    for law in NAMED[1:]:
        found = block(box, kind, law, poisson)[1].stiffness(rest.nodes).toarray()
        assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.parametrize("law", NAMED)
@pytest.mark.parametrize("poisson", [0.0, 0.49])
def test_force_and_stiffness_are_derivatives(box, rotation, check_derivatives, kind, law, poisson):
    """Far from rest; at 1.0 elements are inverted, where the law lets them."""
    for amount in (0.05,) if law in FORBIDS else (0.05, 1.0):
        rest, elasticity = block(box, kind, law, poisson)
        x = crumpled(rest, rotation, amount)
        assert (elasticity.least_det(x) < 0.0) == (amount == 1.0)
        check_derivatives(elasticity, x, 1e-6 * rest.size)


@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.parametrize("law", NAMED)
def test_turning_changes_nothing_and_forces_balance(box, rotation, check_frame, kind, law):
    rest, elasticity = block(box, kind, law)
    scale = MU * rest.size**2
    for angle in [*np.linspace(0, 2 * np.pi, 25), np.pi - 1e-8, 1e-9]:
        x = rest.nodes @ rotation(angle).T + [0.3, -0.2, 0.1]
        assert np.abs(elasticity.force(x)).max() < 1e-10 * scale
        rounding = 1e-19 if law == NAMED[0] else 1e-14
        assert abs(elasticity.energy(x)) < rounding * scale * rest.size
    check_frame(elasticity, crumpled(rest, rotation, 0.05), rest.size, error=1e-10)


@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.parametrize("law", NAMED)
def test_definite_stiffness_has_no_negative_eigenvalue(box, rotation, kind, law):
    rest, elasticity = block(box, kind, law)
    x = 0.6 * crumpled(rest, rotation, 0.02)
    exact, definite = (np.linalg.eigvalsh(elasticity.stiffness(x, d).toarray()) for d in (False, True))
    assert exact[0] < -0.001 * exact[-1] or law in FORBIDS or kind == "mean"
    assert definite[0] > -1e-12 * definite[-1]
    exact, definite = (elasticity.stiffness(rest.nodes, d).data for d in (False, True))
    assert np.abs(exact - definite).max() < 1e-12 * np.abs(exact).max()  # nothing is negative, nothing is changed


@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.parametrize("law", NAMED)
def test_patch_affine_deformations_have_the_stress_of_the_formula(box, rotation, kind, law):
    """Energy V Ψ(F), no force on inner nodes, and −∫ P N on the boundary, by differences of the formula."""
    rest, elasticity = block(box, kind, law, counts=(2, 2, 2))
    (mu, lam), f = (modulus[0] for modulus in elasticity.moduli), rotation(1.3) @ AFFINE
    volume = elasticity.volumes.sum()
    x = rest.nodes @ f.T + [1.0, 2.0, 3.0]
    assert elasticity.energy(x) == pytest.approx(volume * density(law, f, mu, lam), rel=1e-11)
    force = elasticity.force(x)
    inner = np.setdiff1d(np.arange(len(x)), rest.surface)
    assert len(inner) and np.abs(force[inner]).max() < 1e-12 * np.abs(force).max()
    # Σ f xᵀ is the mean stress times the volume
    assert np.abs(-force.T @ rest.nodes - volume * stress(law, f, mu, lam)).max() < 1e-8 * volume * mu


def uniaxial(law, s, young, poisson):
    """Nominal stress and side stretch of a bar with free sides, in closed form where there is one."""
    mu, lam = young / 2 / (1 + poisson), young * poisson / (1 + poisson) / (1 - 2 * poisson)
    if law == "corotational":  # Hooke's law in stretches
        return young * (s - 1), 1 - poisson * (s - 1)
    if law == "st_venant_kirchhoff":  # Hooke's law in Green's strain
        return young * s * (s**2 - 1) / 2, np.sqrt(1 - poisson * (s**2 - 1))
    if law == "neo_hookean":  # Bonet and Wood 2008: Kirchhoff stresses μ (b − I) + λ ln J I, none across
        side = brentq(lambda t: mu * (t**2 - 1) + lam * np.log(s * t**2), 0.2, 3.0, xtol=1e-14)
        return (mu * (s**2 - 1) + lam * np.log(s * side**2)) / s, side
    if law == NAMED[-1]:  # the same with μ times the exponential
        stiff = lambda t: mu * np.exp(STIFFENING * (s**2 + 2 * t**2 - 3 - 2 * np.log(s * t**2)))  # noqa: E731
        side = brentq(lambda t: stiff(t) * (t**2 - 1) + lam * np.log(s * t**2), 0.5, 1.5, xtol=1e-15)
        return (stiff(side) * (s**2 - 1) + lam * np.log(s * side**2)) / s, side
    m, stiff = 4 / 3 * mu, lam + 5 / 6 * mu
    pressure = lambda t: stiff * (s * t**2 - 1 - 3 * m / 4 / stiff)  # noqa: E731
    share = lambda t: m * (1 - 1 / (s**2 + 2 * t**2 + 1))  # noqa: E731
    side = brentq(lambda t: share(t) * t + pressure(t) * s * t, 0.2, 3.0, xtol=1e-14)
    return share(side) * s + pressure(side) * side**2, side


@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.parametrize("law", NAMED)
@pytest.mark.parametrize("stretch", [0.7, 1.4])
def test_a_bar_with_free_sides_bears_the_known_stress(box, kind, law, stretch):
    """Uniaxial stress: at the known side stretch nothing pulls on sides or inside, and the ends bear P times area."""
    mesh = box([3, 1, 1], [0.3, 0.1, 0.1])
    rest = mesh if kind == "linear" else refine(mesh)[0]
    elasticity = ELEMENTS[kind](mesh, Material(3000.0, 0.3, 1000.0, law))
    nominal, side = uniaxial(law, stretch, 3000.0, 0.3)
    force = elasticity.force(rest.nodes * [stretch, side, side])
    end = rest.nodes[:, 0] > 0.3 - 1e-9
    assert force[end].sum(axis=0) == pytest.approx([-nominal * 0.01, 0, 0], abs=1e-9 * 30)
    others = ~end & (rest.nodes[:, 0] > 1e-9)
    assert np.abs(force[others]).max() < 1e-9 * 30 and np.abs(force[:, 1:]).max() < 1e-9 * 30


@pytest.mark.parametrize("kind", ELEMENTS)
@pytest.mark.parametrize("law", NAMED)
@pytest.mark.parametrize("f", [np.diag([1.2, 0.9, -0.4]), np.zeros((3, 3))])
def test_flat_inverted_and_collapsed_elements(box, kind, law, f):
    """Finite energy, force and stiffness that restore them, or a refusal: nothing is NaN."""
    rest, elasticity = block(box, kind, law)
    x = rest.nodes @ f.T
    if law in FORBIDS:
        assert elasticity.energy(x) == np.inf
        with pytest.raises(NotConverged, match="flat or inverted"):
            elasticity.force(x)
        return
    assert 0.0 < elasticity.energy(x) < np.inf
    assert np.isfinite(elasticity.force(x)).all()
    for definite in (False, True):
        assert np.isfinite(elasticity.stiffness(x, definite).data).all()


OWN = (Path(__file__).parents[2] / "examples/hencky.py").read_text(encoding="utf-8")


def test_a_law_of_ones_own_is_one_file(box, rotation, differences):
    path = Path(__file__).parents[2] / "examples/hencky.py"
    assert OWN in (path.parents[1] / "docs/add-a-law.md").read_text(encoding="utf-8")
    rest, elasticity = block(box, "quadratic", str(path))
    x = crumpled(rest, rotation, 0.05)
    slope = differences(elasticity.energy, x, 1e-6 * rest.size).reshape(x.shape)
    assert np.abs(elasticity.force(x) + slope).max() < 1e-7 * np.abs(slope).max()
    mu, lam = (modulus[0] for modulus in elasticity.moduli)
    s = np.array([1.3, 1.1, 0.8])
    expected = mu * np.sum(np.log(s) ** 2) + lam / 2 * np.sum(np.log(s)) ** 2
    assert elasticity.energy(rest.nodes * s) == pytest.approx(1e-3 * np.linalg.det(SKEW) * expected, rel=1e-11)


@pytest.mark.slow
def test_a_law_of_ones_own_works_in_a_second_process(tmp_path):
    path = Path(__file__).parents[2] / "examples/hencky.py"
    run = f"from palpate.effects.law import law_of; law_of({str(path)!r})"
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", run],
            env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "gradient[i] = 2.0 * mu * log",
            "gradient[i] = 3.0 * mu * log",
            "entry 0 of the gradient",
        ),
        ("2.0 * mu * (1.0 - log)", "2.0 * mu", "row 0 of the Hessian is not the derivative of the gradient"),
        ("return energy", "return energy + s[0]", "entry 0 of the gradient"),
        ("lam * log * log", "lam * log * log / (theta - theta)", "not finite"),
        ("def volume", "def volumes", "has no attribute 'volume'"),
        ("log = math.log(theta)", "log, lam = math.log(theta), 2.0 * lam", "Hessian is not 2 mu I"),
    ],
)
def test_a_faulty_law_is_refused_with_its_fault(tmp_path, old, new, said):
    path = tmp_path / f"law_{len(old)}.py"
    assert old in OWN
    path.write_text(OWN.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=said):
        law_of(str(path))


def test_an_unknown_law_is_refused():
    with pytest.raises(InputError, match=r"^law names neo_hokean, which is unknown; did you mean neo_hookean\?$"):
        law_of("neo_hokean")


@pytest.mark.slow
def test_a_second_process_compiles_nothing(tmp_path):
    """All laws and kinds of elements from the kernels that the first process has kept."""
    code = (
        "import numpy as np, numba\n"
        "from palpate.bodies.simple_shapes import box\n"
        "from palpate.bodies.material import NAMED, Material\n"
        "from palpate.effects.linear_elements import LinearElements\n"
        "from palpate.effects import linear_elements\n"
        "mesh = box([1.0, 1.0, 1.0], [1, 1, 1])\n"
        "for law in NAMED:\n"
        "    elements = LinearElements(mesh, Material(3000.0, 0.3, 1000.0, law))\n"
        "    elements.force(mesh.nodes), elements.stiffness(mesh.nodes)\n"
        "print(sum(sum(f.stats.cache_misses.values()) for f in (linear_elements.energy_and_force, "
        "linear_elements.add_stiffness)))\n"
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    counts = [
        int(subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, check=True).stdout)
        for _ in range(2)
    ]
    assert counts[1] == 0


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
