# Whether a finger feels the regions of bodies, and how deep in a slab a ball may lie to be felt.

PALPATED = config["palpation"]["bodies"] or [
    name for name, body in config["bodies"].items() if body.get("regions")
]

TARGETS["palpation"] = (
    merged("palpation", expand("results/data/{body}/palpation.csv", body=PALPATED))
    + tabulated("palpation_limits")
    + figures("palpation", "palpation", "palpation_limits")
)
WARNED += warned_of(PALPATED)


rule measure_palpation:
    input:
        body="results/data/{body}/body.h5",
    output:
        "results/data/{body}/palpation.csv",
    log:
        "results/logs/{body}/measure_palpation.log",
    params:
        settings={
            key: config["palpation"][key] for key in ("radius_m", "places", "pressures_of_young", "felt")
        },
        code=code_of("measure_palpation"),
    message:
        "feel the regions of {wildcards.body}"
    script:
        "../scripts/measure_palpation.py"


rule measure_palpation_limits:
    output:
        "results/tables/palpation_limits.csv",
    log:
        "results/logs/measure_palpation_limits.log",
    params:
        settings={
            key: config["palpation"][key]
            for key in (
                "slab",
                "ball_radius_m",
                "covers_m",
                "contrasts",
                "radius_m",
                "pressure_of_young",
                "felt",
            )
        },
        code=code_of("measure_palpation_limits"),
    message:
        "feel for balls in a slab"
    script:
        "../scripts/measure_palpation_limits.py"
