from palpate.report import style
from palpate.run.job import job, stem
from palpate.scenes.motion import load
from palpate.studies.scenes.figures import motion_stills as pictures
from palpate.studies.scenes.figures import turnable_motion

with job(snakemake.log[0]):
    motion = load(snakemake.input.motion)
    style.save(pictures.stills(motion, count=6), stem(snakemake.output.stills))
    pictures.animate(motion, snakemake.output.animation)
    turnable_motion.write(motion, snakemake.output.turnable)
