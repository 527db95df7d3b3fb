from palpate.figures import style
from palpate.figures.scenes import motion_stills as pictures
from palpate.figures.scenes import turnable_motion
from palpate.job import job, stem
from palpate.scenes.motion import load

with job(snakemake.log[0]):
    motion = load(snakemake.input.motion)
    style.save(pictures.stills(motion, count=6), stem(snakemake.output.stills))
    pictures.animate(motion, snakemake.output.animation)
    turnable_motion.write(motion, snakemake.output.turnable)
