# Paper 2: spring parameters for its cube, found in every way, and what springs can follow at all.

SPRINGS = "results/data/springs"
# what is pressed, without how long searches go on; the tables that each method fills; what they fit
CUBE_PRESSED = {key: value for key, value in config["springs"].items() if key not in ("searches", "floor")}
SPRING_TABLES = ["spring_fit", "spring_history", "spring_errors"]
FORCES = ["springs", "volume"]
METHODS = ["uniform", "van_gelder", "lloyd", "genetic", "cma_es", "gradient", "gradient_smooth", "gradient_all"]

SPRINGS_SHOWN = drawn("springs", "spring_fit", "spring_errors", "spring_floor")


wildcard_constraints:
    method="[a-z_]+",


rule simulate_spring_reference:
    output:
        f"{SPRINGS}/reference.npz",
    log:
        "results/logs/springs/simulate_spring_reference.log",
    params:
        **calls("palpate.studies.springs.spring_fit:simulate_spring_reference"),
        calibration=CUBE_PRESSED,
        poisson=config["springs"]["material"]["poisson"],
    script:
        "../job.py"


rule fit_springs:
    input:
        reference=f"{SPRINGS}/reference.npz",
    output:
        **{force: [f"{SPRINGS}/{force}/{{method}}/{table}.csv" for table in SPRING_TABLES] for force in FORCES},
    log:
        "results/logs/springs/fit_springs_{method}.log",
    benchmark:
        "results/benchmarks/springs/fit_springs_{method}.tsv"
    # individuals are advanced together in the lanes of one core; half of the machine, as their times are reported
    threads: HALF
    params:
        **calls("palpate.studies.springs.spring_fit:fit_springs"),
        calibration=CUBE_PRESSED,
        searches=config["springs"]["searches"],
        seed=config["seed"],
    script:
        "../job.py"


rule measure_spring_floor:
    output:
        in_report("results/tables/spring_floor.csv"),
    log:
        "results/logs/springs/measure_spring_floor.log",
    benchmark:
        "results/benchmarks/springs/measure_spring_floor.tsv"
    priority: 2  # needs nothing, and fills a core while the first job of finite elements compiles what the next ones use
    params:
        **calls("palpate.studies.springs.spring_fit:measure_spring_floor"),
        **config["springs"]["floor"],
        calibration=CUBE_PRESSED,
    script:
        "../job.py"


rule tabulate_springs:
    input:
        rules.measure_spring_floor.output,
        **{
            table: expand(f"{SPRINGS}/{{force}}/{{method}}/{table}.csv", force=FORCES, method=METHODS)
            for table in SPRING_TABLES
        },
    output:
        *map(in_report, tables(*SPRING_TABLES)),
        figures(*SPRINGS_SHOWN),
    log:
        "results/logs/tabulate_springs.log",
    localrule: True
    params:
        **calls("palpate.files:merge", draws=SPRINGS_SHOWN),
    script:
        "../job.py"


rule springs:
    input:
        rules.tabulate_springs.output,
        rules.measure_spring_floor.output,
        page="results/report_springs.html",
