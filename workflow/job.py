"""Call the function of palpate that the rule names; kernels alone use the threads of the rule, libraries use one."""

import os

os.environ |= {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
os.environ["NUMBA_NUM_THREADS"] = str(snakemake.threads)

from inspect import signature
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, get_args, get_origin, get_type_hints

from palpate.run.job import job, kernel_cache, steps, write_table

os.environ["NUMBA_CACHE_DIR"] = str(kernel_cache())
OF_SNAKEMAKE = ("input", "output", "params", "wildcards", "threads")
"""Arguments that a function gets as snakemake has them."""


def arguments(function: Any, say: Any) -> dict[str, Any]:
    """Return by name what the rule has for a function's arguments: OF_SNAKEMAKE, ``say``, ``progress`` and others.

    The others are parameters of the rule, what its input files hold, or wildcards, converted to the type that the
    function annotates, such as an object of settings or a body.
    """
    from pydantic import TypeAdapter

    kinds, values = get_type_hints(function, include_extras=True), {}
    of_rule = snakemake.params, snakemake.input, snakemake.wildcards
    params, files, wildcards = (dict(each.items()) for each in of_rule)
    for name in signature(function).parameters:
        kind = kinds.get(name, Any)
        if name in OF_SNAKEMAKE:
            values[name] = getattr(snakemake, name)
        elif name == "say":
            values[name] = say
        elif name in params:
            values[name] = TypeAdapter(kind).validate_python(params[name])
        elif name in files:
            values[name] = read(files[name], kind)
        elif name in wildcards:
            values[name] = TypeAdapter(kind).validate_python(wildcards[name])
        elif name == "progress":
            values[name] = steps(say, f"{', '.join([snakemake.rule, *snakemake.wildcards])}:")
    return values


def read(file: Any, kind: Any) -> Any:
    """Return what a file holds, of the kind that is annotated; None without one, and a list for ``list[kind]``."""
    import pandas as pd

    from palpate.bodies import body_file
    from palpate.bodies.body import Body
    from palpate.stores import stored

    if get_origin(kind) is list:
        return [read(each, get_args(kind)[0]) for each in file]
    if not file:
        return None
    if kind is pd.DataFrame:
        return pd.read_csv(file)
    return body_file.load(file) if kind is Body else stored(kind, file)


def write(returned: Any, file: str) -> None:
    """Write what a function returned: a table, a database, or a record."""
    kind = type(returned).__name__
    if kind == "DataFrame":
        write_table(returned, file)
    elif kind == "Database":
        resolve_name("palpate.benchmark.database:write")(returned, file)
    else:
        resolve_name("palpate.stores:store")(returned, file)


def draw(figures: dict[str, dict[str, Any]]) -> None:
    """Write results/figures/<name>.png and .svg of each figure from its tables.

    figures : by name, the ``place`` of what draws it ("palpate.studies.NAME.figures:draw_NAME"), the names of the
        ``tables`` that it gets, the ``scene`` if there is one for each, and the file ``published`` if it shows that
    """
    from palpate.files import read_yaml
    from palpate.report import style, tables

    for name, figure in figures.items():
        scene = figure["scene"]
        # of one scene there may be nothing to draw
        shown = [tables.read(f"results/tables/{table}.csv", rows=not scene) for table in figure["tables"]]
        options = {"scene": scene} if scene else {}
        if figure["published"]:
            options["published"] = read_yaml(figure["published"])
        style.save(resolve_name(figure["place"])(*shown, **options), Path("results/figures") / name)


with job(snakemake.log[0], snakemake.output.get("warned")) as say:
    function = resolve_name(snakemake.params.call)
    returned = function(**arguments(function, say))
    if returned is not None:  # several things with the names of outputs, or one for the first output
        several = returned if isinstance(returned, dict) else {0: returned}
        for key, each in several.items():
            write(each, snakemake.output[key])
    if figures := snakemake.params.get("figures"):
        draw(figures)
