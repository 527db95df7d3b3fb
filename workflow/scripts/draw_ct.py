from palpate.bodies.body_file import load
from palpate.bodies.ct.mesh_from_ct import segment_entry
from palpate.report import style
from palpate.run.job import job, stem
from palpate.run.kept_warnings import about
from palpate.studies.ct.figures import ct_slices, ct_volume_rendering

with job(snakemake.log[0]):
    with about(f"bodies.{snakemake.wildcards.body}"):
        image, mask = segment_entry(snakemake.params.entry)
    style.save(ct_slices.draw(image, mask, snakemake.wildcards.body), stem(snakemake.output.slices))
    style.save(ct_volume_rendering.draw(image, mask, load(snakemake.input.body)), stem(snakemake.output.volume))
