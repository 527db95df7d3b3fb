from palpate.report import style
from palpate.run.job import job, stem
from palpate.scenes.motion import load
from palpate.studies.scenes.figures import motion

with job(snakemake.log[0]):
    motion = load(snakemake.input.motion)
    style.save(motion.stills(motion, count=6), stem(snakemake.output.stills))
    motion.animate(motion, snakemake.output.animation)
    motion.write(motion, snakemake.output.turnable)
