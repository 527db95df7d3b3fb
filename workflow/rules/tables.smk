# Tables that are made of settings alone, or that several jobs or studies fill, and figures that only read tables.

# what judges the papers' claims, by the tables of a run that asks for no study
JUDGES = {place: tables for study in RUN for place, tables in claims_of(study).items()}

for settled_rule, (tables, threads, given) in SETTLED.items():

    rule:
        name:
            settled_rule
        output:
            **dict(zip(tables, tabulated(*tables))),
        log:
            f"results/logs/{settled_rule}.log",
        threads: threads
        params:
            **given,
        script:
            "../job.py"


# light enough for a cluster's head node
for study, parts in MERGED.items():

    rule:
        name:
            f"merge_{study}"
        input:
            **parts,
        output:
            tabulated(*parts),
        log:
            f"results/logs/merge_{study}.log",
        localrule: True
        params:
            **calls("palpate.studies.common_jobs:merge"),
        script:
            "../job.py"


for study, shown in FIGURES.items():

    rule:
        name:
            f"draw_{study}"
        input:
            tables=sorted({file for figure in shown.values() for file in tabulated(*figure["tables"])}),
            published=sorted({figure["published"] for figure in shown.values() if figure["published"]}),
        output:
            drawn(*shown),
        log:
            f"results/logs/draw_{study}.log",
        localrule: True
        params:
            **calls(
                "palpate.studies.common_jobs:draw",
                sorted({figure["place"].split(":")[0] for figure in shown.values()}),
            ),
            figures=shown,
        script:
            "../job.py"


if JUDGES:

    rule check_claims:
        input:
            sorted({file for tables in JUDGES.values() for file in tabulated(*tables)}),
        output:
            "results/tables/claims.csv",
        log:
            "results/logs/check_claims.log",
        params:
            **calls("palpate.studies.common_jobs:check_claims", sorted({place.split(":")[0] for place in JUDGES})),
            places=JUDGES,
        script:
            "../job.py"


if ADVISED:

    rule tabulate_advice:
        input:
            table=tabulated("accuracy_vs_time") if "tradeoff" in ADVISED else [],
            errors=family_files("samples") if "tradeoff" in ADVISED else [],
            motions=tabulated("dynamic_accuracy") if "dynamic" in ADVISED else [],
            bounds=tabulated("motion_bounds") if "dynamic" in ADVISED and MOVED else [],
        output:
            "results/tables/advice.csv",
        log:
            "results/logs/tabulate_advice.log",
        params:
            **calls("palpate.studies.tradeoff.jobs:tabulate_advice"),
            limits=(config if "tradeoff" in ADVISED else {"tradeoff": defaults("tradeoff")})["tradeoff"]["advice"],
            moving=some("dynamic", "budgets_ms", "speeds") if "dynamic" in ADVISED else {},
        script:
            "../job.py"
