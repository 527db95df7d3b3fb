from palpate.bodies.ct.mesh_from_ct import segment_entry
from palpate.report import style
from palpate.run.job import job, stem, steps, write_table
from palpate.run.kept_warnings import about
from palpate.studies.ct import figures
from palpate.studies.ct.imaging import measure

with job(snakemake.log[0]) as say:
    masks = {}
    for body, entry in snakemake.params.entries.items():
        with about(f"bodies.{body}"):
            masks[body] = segment_entry(entry)
    found, shown = measure(masks, **snakemake.params.settings, progress=steps(say, "imaging, table"))
    for name, table in found.items():
        write_table(table, snakemake.output[name])
    style.save(figures.draw_ct_imaging(shown, found["mask_interpolation"]), stem(snakemake.output.figure))
