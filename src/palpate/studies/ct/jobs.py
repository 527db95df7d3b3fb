"""Functions that the rules of workflow/rules/ct.smk call; palpate.studies.jobs says how."""

import pandas as pd

from palpate.errors import about
from palpate.run.job import stem, steps


def tabulate_node_mass(params, say):
    from palpate.bodies.ct.mesh_from_ct import segment_entry
    from palpate.studies.ct.node_mass import measure

    tables = []
    for body, entry in params.entries.items():
        with about(f"bodies.{body}"):
            image, mask = segment_entry(entry)
        progress = steps(say, f"{body}: node masses, resolution")
        tables.append(measure(body, image, mask, params.sizes, progress=progress))
    return pd.concat(tables)


def draw_ct(input, output, params, wildcards):
    from palpate.bodies.body_file import load
    from palpate.bodies.ct.mesh_from_ct import segment_entry
    from palpate.report import style
    from palpate.studies.ct.figures import draw_ct_slices, draw_ct_volume_rendering

    with about(f"bodies.{wildcards.body}"):
        image, mask = segment_entry(params.entry)
    style.save(draw_ct_slices(image, mask, wildcards.body), stem(output.slices))
    style.save(draw_ct_volume_rendering(image, mask, load(input.body)), stem(output.volume))


def measure_imaging(output, params, say):
    from palpate.bodies.ct.mesh_from_ct import segment_entry
    from palpate.report import style
    from palpate.studies.ct.figures import draw_ct_imaging
    from palpate.studies.ct.imaging import measure

    masks = {}
    for body, entry in params.entries.items():
        with about(f"bodies.{body}"):
            masks[body] = segment_entry(entry)
    found, shown = measure(masks, **params.settings, progress=steps(say, "imaging, table"))
    style.save(draw_ct_imaging(shown, found["mask_interpolation"]), stem(output.figure))
    return found
