# Paper 2: spring parameters for its cube, found in every way, and what springs can follow at all.

SPRINGS = "results/data/springs"
CALIBRATING = sources(
    "bodies",
    "effects",
    "solvers",
    "calibration",
    "evaluation/spring_experiment",
    "evaluation/spring_fit",
)


wildcard_constraints:
    poisson="[0-9.e-]+",
    method="[a-z_]+",
    force="springs|volume",


rule simulate_spring_reference:
    input:
        code=CALIBRATING,
    output:
        f"{SPRINGS}/reference_{{poisson}}.npz",
    log:
        "results/logs/springs/simulate_spring_reference_{poisson}.log",
    params:
        calibration=SPRING_PHYSICS,
    message:
        "press paper 2's cube, finite elements, Poisson's ratio {wildcards.poisson}"
    script:
        "../scripts/simulate_spring_reference.py"


rule fit_springs:
    input:
        reference=f"{SPRINGS}/reference_{config['calibration']['material']['poisson']}.npz",
        code=CALIBRATING,
    output:
        [f"{SPRINGS}/{{force}}/{{method}}/{table}.csv" for table in SPRING_TABLES],
    log:
        "results/logs/springs/{force}/fit_springs_{method}.log",
    # a generation is shared among cores
    threads: lambda wildcards: workflow.cores if wildcards.method in ("genetic", "cma_es") else HALF
    params:
        calibration=SPRING_PHYSICS,
        searches=config["calibration"]["searches"],
        seed=config["seed"],
    message:
        "fit springs: {wildcards.method}, {wildcards.force}"
    script:
        "../scripts/fit_springs.py"


rule tabulate_spring_floor:
    input:
        reference=f"{SPRINGS}/reference_{{poisson}}.npz",
        code=CALIBRATING + sources("evaluation/spring_floor"),
    output:
        f"{SPRINGS}/floor_{{poisson}}.csv",
    log:
        "results/logs/springs/tabulate_spring_floor_{poisson}.log",
    params:
        calibration=SPRING_PHYSICS,
        evaluations=config["calibration"]["floor"]["evaluations"],
    message:
        "find the springs' floor, Poisson's ratio {wildcards.poisson}"
    script:
        "../scripts/tabulate_spring_floor.py"


rule draw_springs:
    input:
        tabulated("spring_history", "spring_errors", "spring_floor"),
        code=PICTURES,
    output:
        drawn("spring_fit", "spring_errors", "spring_floor"),
    log:
        "results/logs/draw_springs.log",
    message:
        "draw paper 2's experiments"
    script:
        "../scripts/draw_springs.py"
