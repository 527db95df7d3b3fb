"""Check a law of the user's own at rest and near it, before anything is computed with it."""

import numpy as np

from palpate.effects.law import Law, evaluate

MU, LAM = 1.0, 1.5
STRETCHES = ([1.2, 1.05, 0.9], [1.1, 1.0, 0.8], [1.0, 1.0, 1.0])


def fault(law: Law) -> str:
    """Describe the first fault of a law: wrong derivatives, stress at rest, or other moduli; empty if there is none."""
    for s in STRETCHES:
        energy, slopes, curvatures = evaluate(law, np.array(s), MU, LAM)
        if not np.isfinite([energy, *slopes, *curvatures.ravel()]).all():
            return f"at the stretches {s} the energy or its derivatives are not finite"
        for i, step in enumerate(1e-6 * np.eye(3)):
            more, less = (evaluate(law, np.array(s) + sign * step, MU, LAM) for sign in (1.0, -1.0))
            if abs((more[0] - less[0]) / 2e-6 - slopes[i]) > 1e-6:
                return f"at the stretches {s} slope {i} is not the derivative of the energy"
            if np.abs((more[1] - less[1]) / 2e-6 - curvatures[i]).max() > 1e-6:
                return f"at the stretches {s} row {i} of the curvatures is not the derivative of the slopes"
    _, slopes, curvatures = evaluate(law, np.ones(3), MU, LAM)
    if np.abs(slopes).max() > 1e-9:
        return f"at rest the principal stresses are {slopes.tolist()} and not zero"
    if np.abs(curvatures - LAM - 2.0 * MU * np.eye(3)).max() > 1e-9:
        return "at rest the curvatures are not 2 mu I + lam, so that Young's modulus and Poisson's ratio do not hold"
    return ""
