"""Functions that the rules of workflow/rules/hard_cases.smk call; palpate.studies.jobs says how."""

from palpate.run.job import steps


def try_hard_cases(wildcards, say):
    from palpate.studies.hard_cases.declared import measure

    table = measure(wildcards.family, steps(say, f"hard cases of {wildcards.family}:"))
    for row in table[~table["passed"]].itertuples():
        said = f"{row.case} with {row.model} is {row.outcome}, declared {row.declared}"
        say(f"warning: {said}: {row.value} {row.message}")
    return table
