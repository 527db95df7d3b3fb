# Paper 2: spring parameters for its cube, found in every way, and what springs can follow at all.

SPRINGS = "results/data/springs"
# what is pressed, without how long searches go on; the tables that each method fills; what they fit
CUBE_PRESSED = {key: value for key, value in config["springs"].items() if key not in ("searches", "floor")}
SPRING_TABLES = ["spring_fit", "spring_history", "spring_errors"]
METHODS = [
    "uniform",
    "van_gelder",
    "lloyd",
    "genetic",
    "cma_es",
    "gradient",
    "gradient_smooth",
    "gradient_all",
]
FITTED = expand(f"{SPRINGS}/{{force}}/{{method}}", force=["springs", "volume"], method=METHODS)

TARGETS["springs"] = (
    [
        file
        for table in SPRING_TABLES
        for file in merged(table, [f"{folder}/{table}.csv" for folder in FITTED])
    ]
    + merged(
        "spring_floor",
        expand(f"{SPRINGS}/floor_{{poisson}}.csv", poisson=config["springs"]["floor"]["poissons"]),
    )
    + figures("springs", "spring_fit", "spring_errors", "spring_floor")
)


wildcard_constraints:
    poisson="[0-9.e-]+",
    method="[a-z_]+",
    force="springs|volume",


rule simulate_spring_reference:
    output:
        f"{SPRINGS}/reference_{{poisson}}.npz",
    log:
        "results/logs/springs/simulate_spring_reference_{poisson}.log",
    params:
        calibration=CUBE_PRESSED,
        code=code_of("simulate_spring_reference"),
    message:
        "press paper 2's cube, finite elements, Poisson's ratio {wildcards.poisson}"
    script:
        "../scripts/simulate_spring_reference.py"


rule fit_springs:
    input:
        reference=f"{SPRINGS}/reference_{config['springs']['material']['poisson']}.npz",
    output:
        [f"{SPRINGS}/{{force}}/{{method}}/{table}.csv" for table in SPRING_TABLES],
    log:
        "results/logs/springs/{force}/fit_springs_{method}.log",
    # individuals are advanced together in the lanes of one core; half of the machine, as their times are reported
    threads: HALF
    params:
        calibration=CUBE_PRESSED,
        searches=config["springs"]["searches"],
        seed=config["seed"],
        code=code_of("fit_springs"),
    message:
        "fit springs: {wildcards.method}, {wildcards.force}"
    script:
        "../scripts/fit_springs.py"


rule tabulate_spring_floor:
    input:
        reference=f"{SPRINGS}/reference_{{poisson}}.npz",
    output:
        f"{SPRINGS}/floor_{{poisson}}.csv",
    log:
        "results/logs/springs/tabulate_spring_floor_{poisson}.log",
    params:
        calibration=CUBE_PRESSED,
        evaluations=config["springs"]["floor"]["evaluations"],
        code=code_of("tabulate_spring_floor"),
    message:
        "find the springs' floor, Poisson's ratio {wildcards.poisson}"
    script:
        "../scripts/tabulate_spring_floor.py"
