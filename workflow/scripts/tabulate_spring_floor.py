from palpate.run.job import job, write_table
from palpate.studies.springs.spring_experiment import experiment, load_references
from palpate.studies.springs.spring_fit import INCOMPRESSIBLE, measure

with job(snakemake.log[0]):
    calibration = snakemake.params.calibration
    found = experiment(calibration, float(snakemake.wildcards.poisson))
    stiffest = experiment(calibration, INCOMPRESSIBLE).volume_n_m()
    references = load_references(snakemake.input.reference)
    write_table(measure(found, references, stiffest, snakemake.params.evaluations), snakemake.output[0])
