"""Functions that the rules of workflow/rules/scaling.smk call; palpate.studies.jobs says how."""

from palpate.run.job import powers, use_threads


def measure_scaling(params, wildcards, threads, say):
    use_threads(threads)  # before numba is imported; this job runs alone
    from palpate.studies.scaling.measure_scaling import doubling, measure

    component = wildcards.component
    # the component "cores" uses all cores; the others run on one
    table = measure(component, params.sizes or doubling(threads), lambda size: say(f"{component}: {size} done"))
    for row in table.drop_duplicates("stage").itertuples():
        said = powers({"time": row.seconds_exponent, "memory": row.memory_exponent})
        say(f"{row.stage}: {said or 'no growth to fit'}")
    return table
