from palpate.bodies.body_file import load
from palpate.bodies.ct.mesh_from_ct import segment_entry
from palpate.report import style
from palpate.run.job import job, stem
from palpate.run.kept_warnings import about
from palpate.studies.ct import figures

with job(snakemake.log[0]):
    with about(f"bodies.{snakemake.wildcards.body}"):
        image, mask = segment_entry(snakemake.params.entry)
    style.save(figures.draw_ct_slices(image, mask, snakemake.wildcards.body), stem(snakemake.output.slices))
    style.save(
        figures.draw_ct_volume_rendering(image, mask, load(snakemake.input.body)), stem(snakemake.output.volume)
    )
