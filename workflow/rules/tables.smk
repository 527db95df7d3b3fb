# Tables that are made of settings alone, or that several jobs or studies fill, and figures that only read tables.

# what judges the papers' claims, by the tables of the studies that are asked for
JUDGES = {place: tables for study in ASKED for place, tables in claims_of(study).items()}
# the report reads this table beside those of the studies
CLAIMS = tabulated("claims", "claim_links") if JUDGES else []
OPTIONAL += ["claims", "claim_links"] if JUDGES else []
# the tables of this run that numbers of README come from
README_QUERIES = relpath(ROOT / "docs/readme.yaml")
TRACED = tabulated(*sorted({entry["table"] for entry in read_yaml(README_QUERIES)["traced"]}))


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
for first, parts in MERGED.items():

    rule:
        name:
            f"merge_{first}"
        input:
            **parts,
        output:
            tabulated(*parts),
        log:
            f"results/logs/merge_{first}.log",
        localrule: True
        params:
            **calls("palpate.studies.common_jobs:merge"),
        script:
            "../job.py"


for first, shown in FIGURES.items():

    rule:
        name:
            f"draw_{first}"
        input:
            tables=sorted({file for figure in shown.values() for file in tabulated(*figure["tables"])}),
            published=sorted({figure["published"] for figure in shown.values() if figure["published"]}),
        output:
            drawn(*shown),
        log:
            f"results/logs/draw_{first}.log",
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
            judged=sorted({file for tables in JUDGES.values() for file in tabulated(*tables)}),
            traced=[file for file in TRACED if any(file in TARGETS[study] for study in ASKED)],
            readme=README_QUERIES,
        output:
            claims=CLAIMS[0],
            claim_links=CLAIMS[1],
        log:
            "results/logs/check_claims.log",
        params:
            **calls("palpate.studies.common_jobs:check_claims", sorted({place.split(":")[0] for place in JUDGES})),
            places=JUDGES,
        script:
            "../job.py"


if {"tradeoff", "dynamic"} & set(ASKED):

    rule tabulate_advice:
        input:
            table=tabulated("accuracy_vs_time") if "tradeoff" in ASKED else [],
            errors=family_files("samples") if "tradeoff" in ASKED else [],
            motions=tabulated("dynamic_accuracy") if "dynamic" in ASKED else [],
            bounds=tabulated("motion_bounds") if "motion_bounds" in OPTIONAL else [],
        output:
            "results/tables/advice.csv",
        log:
            "results/logs/tabulate_advice.log",
        params:
            **calls("palpate.studies.tradeoff.jobs:tabulate_advice"),
            limits=(config if "tradeoff" in ASKED else {"tradeoff": defaults("tradeoff")})["tradeoff"]["advice"],
            moving=some("dynamic", "budgets_ms", "speeds") if "dynamic" in ASKED else {},
        script:
            "../job.py"
