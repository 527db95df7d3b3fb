# Tables that several jobs or studies fill, and figures that only read tables.

# what judges the papers' claims, by the tables of the studies that are asked for
JUDGES = {place: tables for study in ASKED for place, tables in claims_of(study).items()}
# the report reads this table beside those of the studies
CLAIMS = tabulated("claims") if JUDGES else []
OPTIONAL += ["claims"] if JUDGES else []


rule merge_table:
    input:
        lambda wildcards: MERGED[wildcards.table],
    output:
        "results/tables/{table}.csv",
    log:
        "results/logs/merge_table_{table}.log",
    wildcard_constraints:
        table="|".join(MERGED) or "nothing",
    params:
        code=code_of("merge_table"),
    message:
        "merge the table {wildcards.table}"
    script:
        "../scripts/merge_table.py"


rule draw:
    input:
        tables=lambda wildcards: tabulated(*FIGURES[wildcards.figure]["tables"]),
        published=lambda wildcards: FIGURES[wildcards.figure]["published"],
    output:
        drawn("{figure}"),
    log:
        "results/logs/draw/{figure}.log",
    wildcard_constraints:
        figure="|".join(FIGURES) or "nothing",
    params:
        place=lambda wildcards: FIGURES[wildcards.figure]["place"],
        scene=lambda wildcards: FIGURES[wildcards.figure]["scene"],
        code=lambda wildcards: code_of("draw", FIGURES[wildcards.figure]["place"].split(":")[0]),
    message:
        "draw {wildcards.figure}"
    script:
        "../scripts/draw.py"


if JUDGES:

    rule check_claims:
        input:
            sorted({file for tables in JUDGES.values() for file in tabulated(*tables)}),
        output:
            CLAIMS,
        log:
            "results/logs/check_claims.log",
        params:
            places=JUDGES,
            code=code_of("check_claims", *(place.split(":")[0] for place in JUDGES)),
        message:
            "check the papers' claims"
        script:
            "../scripts/check_claims.py"


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
            limits=(config if "tradeoff" in ASKED else {"tradeoff": defaults(SCHEMA, "tradeoff")})[
                "tradeoff"
            ]["advice"],
            speeds=config.get("dynamic", {}).get("speeds", []),
            code=code_of("tabulate_advice"),
        message:
            "advise a model for each budget and error"
        script:
            "../scripts/tabulate_advice.py"
