# Tables that several jobs fill.


rule merge_table:
    input:
        lambda wildcards: MERGED[wildcards.table],
    output:
        "results/tables/{table}.csv",
    log:
        "results/logs/merge_table_{table}.log",
    wildcard_constraints:
        table="|".join(MERGED),
    message:
        "merge the table {wildcards.table}"
    script:
        "../scripts/merge_table.py"
