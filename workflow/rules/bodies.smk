# What is deformed: nested meshes, and their linear response to a unit force at every contact.

# settings of a body that say how many samples it gets and what the paper had, not what it is
NOT_OF_THE_BODY = {"magnitudes", "train", "test", "paper_surface"}


def body_paths(name):
    """The files or folders a body is made from, by key; given relative to the folder of the config file."""
    body = config["bodies"][name]
    return {
        key: normpath(CONFIG_FILE.parent / body[key])
        for key in ("path", "image", "mask")
        if body.get(key) is not None
    }


def body_files(name):
    """The files a body is made from; of a folder, such as a DICOM series, every one in it."""
    paths = map(Path, body_paths(name).values())
    return [str(file) for path in paths for file in (sorted(path.iterdir()) if path.is_dir() else [path])]


def body_entry(name):
    """What a body is made from."""
    body = config["bodies"][name] | body_paths(name)
    return {key: value for key, value in body.items() if key not in NOT_OF_THE_BODY}


# bodies made from a CT, which get pictures and masses of their own
CTS = [name for name, body in config["bodies"].items() if body["kind"] == "ct"]
# bodies whose meshes are tabulated
MEASURED = list(dict.fromkeys((BODIES if "enrichment" in ASKED else []) + (CTS if "ct" in ASKED else [])))


rule make_body:
    input:
        files=lambda wildcards: body_files(wildcards.body),
    output:
        "results/data/{body}/body.h5",
    log:
        "results/logs/{body}/make_body.log",
    params:
        entry=lambda wildcards: body_entry(wildcards.body),
        code=code_of("make_body"),
    message:
        "make the body {wildcards.body}"
    script:
        "../scripts/make_body.py"


rule compute_compliance:
    input:
        body="results/data/{body}/body.h5",
    output:
        "results/data/{body}/compliance_{radius}m.h5",
    log:
        "results/logs/{body}/compute_compliance_{radius}m.log",
    params:
        code=code_of("compute_compliance"),
    message:
        "compute the compliance of {wildcards.body}"
    script:
        "../scripts/compute_compliance.py"


rule tabulate_meshes:
    input:
        bodies=expand("results/data/{body}/body.h5", body=MEASURED),
    output:
        sizes="results/tables/mesh_sizes.csv",
        quality="results/tables/mesh_quality.csv",
    log:
        "results/logs/tabulate_meshes.log",
    params:
        paper={name: body.get("paper_surface") for name, body in config["bodies"].items()},
        code=code_of("tabulate_meshes"),
    message:
        "tabulate mesh sizes and quality"
    script:
        "../scripts/tabulate_meshes.py"
