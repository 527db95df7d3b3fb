"""Laws between deformation and energy: the functions that a law's file has, compiled and checked.

A law is an energy density of the signed singular values s₁ ≥ s₂ ≥ |s₃| of F in two parts, Ψ = W(s) + U(θ(s)): W
resists changes of shape, and is without stress at rest; U resists those of a measure of volume θ, which mean dilatation
averages over an element. Its file, one of those in ``laws`` or the user's own, has three functions of plain Python that
numba compiles:

    shape(s, mu, gradient, hessian)         returns W [J/m³], writes ∂W/∂s (3,) and ∂²W/∂s² (3, 3)
    measure(s, gradient, hessian)           returns θ, writes ∂θ/∂s and ∂²θ/∂s²
    volume(theta, mu, lam, derivatives)      returns U [J/m³], writes U′ and U″ (2,)

A law with a parameter has ``shape_of(parameter)`` in place of ``shape``, which returns it; its name has the number.
A kernel gets them as pointers, so that it is compiled once and serves every law. A law of the user's own is checked at
rest and near it first.
"""

import warnings
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numba
import numpy as np
from numba import types
from numba.core.errors import NumbaExperimentalFeatureWarning

from palpate.bodies.material import NAMED, kind_of, stiffening_of
from palpate.effects.principal import density
from palpate.errors import InputError, describe_unknown

# numba says so of every kernel that gets pointers to functions
warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)

_VECTOR, _MATRIX = types.Array(types.float64, 1, "C"), types.Array(types.float64, 2, "C")
SIGNATURES = {
    "shape": types.float64(_VECTOR, types.float64, _VECTOR, _MATRIX),
    "measure": types.float64(_VECTOR, _VECTOR, _MATRIX),
    "volume": types.float64(types.float64, types.float64, types.float64, _VECTOR),
}


class Law(NamedTuple):
    """The compiled functions of a law; all None for the corotational one, whose kernels need none."""

    shape: Callable | None
    measure: Callable | None
    volume: Callable | None


PLAIN = Law(None, None, None)
"""The corotational law in kernels of its own, without decompositions."""
INVERTED = np.array([1.0, 1.0, -0.5])
"""Stretches of an inverted element."""


@cache
def law_of(name: str) -> Law:
    """Return the law of this ``name``, one of NAMED, or that in a user's file; InputError if the file has none."""
    if kind := kind_of(name):
        return _compiled(import_module(f"palpate.effects.laws.{kind}"), True, stiffening_of(name))
    from palpate.own_file import failure, import_file

    path = Path(name)
    if path.suffix != ".py":
        raise InputError(f"law names {describe_unknown([name], list(NAMED))}")
    module = import_file(path, "law")
    try:
        law = _compiled(module, kept=False)
        flaw = fault(law)
    except Exception as error:
        raise InputError(
            f"{path}: does not work as a law ({failure(error)}); correct it, see docs/add-a-law.md."
        ) from error
    if flaw:
        raise InputError(f"{path}: {flaw}; correct it, see docs/add-a-law.md.")
    return law


def _compiled(module: ModuleType, kept: bool, stiffening: float | None = None) -> Law:
    """Return the law of a ``module``, whose functions are compiled.

    kept : whether numba stores the machine code for later processes; not that of a user's file, which it cannot import
    stiffening : parameter of ``shape_of``, which the module then has in place of ``shape``, compiled as a constant.
        Trap: that code is never stored, as it has the same symbol for two stiffenings, so that a process which reads
        both could take one for the other.
    """
    made = {} if stiffening is None else {"shape": module.shape_of(stiffening)}
    functions = {name: made.get(name) or getattr(module, name) for name in SIGNATURES}
    compilers = {
        name: numba.cfunc(SIGNATURES[name], cache=kept and name not in made, error_model="numpy") for name in SIGNATURES
    }
    return Law(**{name: compilers[name](function) for name, function in functions.items()})


def evaluate(law: Law, s: np.ndarray, mu: float, lam: float) -> tuple[float, np.ndarray, np.ndarray]:
    """Return Ψ [J/m³], ∂Ψ/∂s (3,) and ∂²Ψ/∂s² (3, 3) [Pa] at the stretches ``s`` (3,); ``law`` is not PLAIN."""
    gradient, hessian = np.empty(3), np.empty((3, 3))
    return density(np.asarray(s, dtype=float), mu, lam, *law, gradient, hessian), gradient, hessian


MU, LAM = 1.0, 1.5
STRETCHES = ([1.2, 1.05, 0.9], [1.1, 1.0, 0.8], [1.0, 1.0, 1.0])


def fault(law: Law) -> str:
    """Describe the first fault of a law: wrong derivatives, stress at rest, or other moduli; empty if there is none."""
    for s in STRETCHES:
        energy, gradient, hessian = evaluate(law, np.array(s), MU, LAM)
        if not np.isfinite([energy, *gradient, *hessian.ravel()]).all():
            return f"at the stretches {s} the energy or its derivatives are not finite"
        for i, step in enumerate(1e-6 * np.eye(3)):
            ahead, behind = (evaluate(law, np.array(s) + sign * step, MU, LAM) for sign in (1.0, -1.0))
            if abs((ahead[0] - behind[0]) / 2e-6 - gradient[i]) > 1e-6:
                return f"at the stretches {s} entry {i} of the gradient is not the derivative of the energy"
            if np.abs((ahead[1] - behind[1]) / 2e-6 - hessian[i]).max() > 1e-6:
                return f"at the stretches {s} row {i} of the Hessian is not the derivative of the gradient"
    _, gradient, hessian = evaluate(law, np.ones(3), MU, LAM)
    if np.abs(gradient).max() > 1e-9:
        return f"at rest the principal stresses are {gradient.tolist()} and not zero"
    if np.abs(hessian - LAM - 2.0 * MU * np.eye(3)).max() > 1e-9:
        return "at rest the Hessian is not 2 mu I + lam, so that Young's modulus and Poisson's ratio do not hold"
    return ""
