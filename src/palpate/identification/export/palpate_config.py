"""Identified numbers as a part of palpate's config: constants of the body, and the effect of its relaxation."""

import json

from palpate.identification.export.numbers import Numbers


def snippet(numbers: Numbers, bed_n_m3: float | None = None) -> str:
    """Return YAML: keys of ``bodies.<name>``, and of a scene where relaxation was identified.

    bed_n_m3 : stiffness of a bed for Young's modulus 1 Pa [N/m³], which is in proportion to it, None without a bed
    """
    heading = "# Identified from presses. palpate's quadratic elements need no correction for their mesh.\n"
    lines = ["bodies:", f"  {numbers.name}:"]
    rate = "" if numbers.relaxation is None else f"  # at rest; {numbers.young_pa:.6g} Pa at the rate of the presses"
    lines += [
        f"    young_pa: {numbers.settled_pa:.6g}{rate}",
        f"    poisson: {numbers.poisson:.4g}",
        f"    density_kg_m3: {numbers.density_kg_m3:.6g}",
        f"    law: {numbers.law}",
    ]
    if bed_n_m3 is not None:
        lines.append(f"    bed: {{stiffness_n_m3: {bed_n_m3 * numbers.settled_pa:.4g}}}  # where palpate init puts it")
    if numbers.relaxation is not None:
        shares, times = (
            json.dumps([float(f"{each:.6g}") for each in values])
            for values in (numbers.relaxation.shares, numbers.relaxation.times_s)
        )
        lines += ["scenes:", f"  {numbers.name}_relaxes:  # add prony to its effects", f"    body: {numbers.name}"]
        lines += [f"    prony: {{shares: {shares}, times_s: {times}}}"]
    return heading + "\n".join(lines) + "\n"
