# Which model to take for a budget of time or an error that must not be passed, and the diagrams that show it.


rule tabulate_advice:
    input:
        table="results/tables/accuracy_vs_time.csv",
        samples=expand(each("tradeoff/{{model}}.csv"), model=COMPARED),
        splits=each("split.csv"),
        motions=DYNAMIC[:1],
        code=sources(
            "evaluation/advice",
            "evaluation/advice_motion",
            "evaluation/advice_reasons",
            "evaluation/resampling",
            "evaluation/ties",
        ),
    output:
        "results/tables/advice.csv",
    log:
        "results/logs/tabulate_advice.log",
    params:
        limits=config["tradeoff"]["advice"],
    message:
        "advise a model for each budget and error"
    script:
        "../scripts/tabulate_advice.py"


rule draw_work_precision:
    input:
        settings="results/tables/accuracy_vs_time.csv",
        advice="results/tables/advice.csv",
        code=PICTURES,
    output:
        drawn("work_precision_{body}_{regime}"),
    log:
        "results/logs/{body}/{regime}/draw_work_precision.log",
    params:
        scene="{body}_{regime}",
    message:
        "draw what accuracy costs: {wildcards.body}, {wildcards.regime}"
    script:
        "../scripts/draw_work_precision.py"


rule draw_advice:
    input:
        settings="results/tables/accuracy_vs_time.csv",
        advice="results/tables/advice.csv",
        code=PICTURES,
    output:
        advice=drawn("advice"),
        break_even=drawn("break_even"),
    log:
        "results/logs/draw_advice.log",
    message:
        "draw the advice, and when preparing pays"
    script:
        "../scripts/draw_advice.py"
