# Tables of several studies: what is advised, and what becomes of the papers' claims.


rule tabulate_advice:
    input:
        table=tables("accuracy_vs_time") if "tradeoff" in ADVISED else [],
        errors=family_files("samples") if "tradeoff" in ADVISED else [],
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
        **calls("palpate.studies.common_jobs:check_claims", *sorted({place.split(":")[0] for place in JUDGES})),
        places=JUDGES,
    script:
        "../job.py"
