"""Young's modulus from one case: the one at which the markers sink as far as they did."""

from collections.abc import Callable

from palpate.errors import NotConverged

STEPS, ENOUGH = 12, 1e-4
"""Most equilibria, and the relative error of the way that ends the search."""


def calibrate(sink: Callable[[float], float], wanted: float) -> float:
    """Find the softness s with ``sink(s)`` = ``wanted`` [m]: how many times softer than assumed the body is.

    sink : the way [m] of the markers under the case's loads, for a body s times softer; it increases with s
    The secant method on way over softness, which bends little; NotConverged if the way is not met.
    """
    softness, history = [1.0], []
    ways = [sink(1.0)]
    for _ in range(STEPS):
        history.append(abs(ways[-1] / wanted - 1.0))
        if history[-1] <= ENOUGH:
            return softness[-1]
        if len(ways) == 1:
            following = wanted / ways[-1]
        else:
            slope = (ways[-1] - ways[-2]) / (softness[-1] - softness[-2])
            following = softness[-1] + (wanted - ways[-1]) / slope
        # never more than four times softer or stiffer at once: a beam that curls up has no slope left
        softness.append(min(max(following, softness[-1] / 4), 4 * softness[-1]))
        ways.append(sink(softness[-1]))
    raise NotConverged(f"no modulus lets the markers sink by {wanted:.3g} m; see loads, density and down", history)
