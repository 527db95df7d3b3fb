from palpate.run.job import job
from palpate.studies.springs.spring_experiment import experiment, save_references, simulate_references

with job(snakemake.log[0]):
    calibration = snakemake.params.calibration
    found = experiment(calibration, float(snakemake.wildcards.poisson))
    save_references(simulate_references(found, calibration["substeps"]), snakemake.output[0])
