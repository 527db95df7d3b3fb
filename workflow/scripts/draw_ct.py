from palpate.bodies.ct import segmented
from palpate.bodies.store import load
from palpate.figures import ct_slices, ct_volume, style
from palpate.job import job, stem

with job(snakemake.log[0]):
    image, mask = segmented(snakemake.params.entry)
    style.save(ct_slices.draw(image, mask, snakemake.wildcards.body), stem(snakemake.output.slices))
    style.save(ct_volume.draw(image, mask, load(snakemake.input.body)), stem(snakemake.output.volume))
