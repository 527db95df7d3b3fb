"""Identified numbers as a part of palpate's config: constants of the body, and the effect of its relaxation."""

import json

from palpate.identification.export.numbers import Numbers


def snippet(numbers: Numbers) -> str:
    """Return YAML: keys of ``bodies.<name>``, and of a scene where relaxation was identified."""
    said = "# Identified from presses. palpate's quadratic elements need no correction for their mesh.\n"
    lines = ["bodies:", f"  {numbers.name}:"]
    rate = "" if numbers.relaxation is None else f"  # at rest; {numbers.young_pa:.6g} Pa at the rate of the presses"
    lines += [
        f"    young_pa: {numbers.settled_pa:.6g}{rate}",
        f"    poisson: {numbers.poisson:.4g}",
        f"    density_kg_m3: {numbers.density_kg_m3:.6g}",
        f"    law: {numbers.law}",
    ]
    if numbers.relaxation is not None:
        shares, times = (
            json.dumps([float(f"{each:.6g}") for each in values])
            for values in (numbers.relaxation.shares, numbers.relaxation.times_s)
        )
        lines += ["scenes:", f"  {numbers.name}_relaxes:  # add prony to its effects", f"    body: {numbers.name}"]
        lines += [f"    prony: {{shares: {shares}, times_s: {times}}}"]
    return said + "\n".join(lines) + "\n"
