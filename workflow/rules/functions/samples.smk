# The files of samples, and how many a body gets.


def count(body):
    """How many samples a body gets in each regime."""
    return config["bodies"][body]["train"] + config["bodies"][body]["test"]


def fine_batches(body, regime):
    jobs = -(-count(body) // config["solver"]["samples_per_job"])
    return [f"results/data/{body}/{regime}/fine_{batch}.h5" for batch in range(jobs)]


def compliance_of(body, regime):
    """A body's compliance depends on the regime only through the radius of the press."""
    return f"results/data/{body}/compliance_{float(config['regimes'][regime]['radius_m'])}m.h5"


def each(pattern):
    """One file for each body and regime."""
    return expand(f"results/data/{{body}}/{{regime}}/{pattern}", body=BODIES, regime=REGIMES)
