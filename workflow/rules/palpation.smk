# Whether a finger feels the regions of bodies, and how deep in a slab a ball may lie to be felt.

PALPATED = config["palpation"]["bodies"] or [name for name, body in config["bodies"].items() if body.get("regions")]
IN_SLAB = ("slab", "ball_radius_m", "covers_m", "contrasts", "radius_m", "pressure_of_young", "felt")

TARGETS["palpation"] = merged("palpation", palpation=expand("results/data/{body}/palpation.csv", body=PALPATED))
TARGETS["palpation"] += settled(
    "palpate.studies.palpation.palpation:measure_palpation_limits",
    "palpation_limits",
    settings=some("palpation", *IN_SLAB),
)
TARGETS["palpation"] += figures("palpation", "palpation", "palpation_limits")
WARNED["palpation"] += warned_of(PALPATED)


rule measure_palpation:
    input:
        body=BODY,
    output:
        "results/data/{body}/palpation.csv",
    log:
        "results/logs/{body}/measure_palpation.log",
    params:
        **calls("palpate.studies.palpation.palpation:measure_palpation"),
        settings=some("palpation", "radius_m", "places", "pressures_of_young", "felt"),
    script:
        "../job.py"
