from importlib import import_module

from palpate.files import read_yaml
from palpate.report import style, tables
from palpate.run.job import job, stem

with job(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    # of one scene there may be nothing to draw
    read = [tables.read(path, rows=not params.scene) for path in given.tables]
    options = {"scene": params.scene} if params.scene else {}
    if given.published:
        options["published"] = read_yaml(given.published[0])
    module, _, function = params.place.partition(":")
    style.save(getattr(import_module(module), function)(*read, **options), stem(snakemake.output))
