from palpate.figures import style, tables
from palpate.figures.scenes import contact_force
from palpate.job import job, stem

with job(snakemake.log[0]):
    felt = tables.read(snakemake.input.force, rows=False)
    style.save(contact_force.draw(felt, scene=snakemake.wildcards.scene), stem(snakemake.output))
