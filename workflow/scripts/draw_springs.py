from pathlib import Path

from palpate.figures import style, tables
from palpate.figures.springs import spring_errors, spring_fit, spring_floor
from palpate.job import job

FIGURES = {"spring_fit": (spring_fit, "spring_history"), "spring_errors": (spring_errors, "spring_errors")}
FIGURES |= {"spring_floor": (spring_floor, "spring_floor")}

with job(snakemake.log[0]):
    read = {Path(path).stem: tables.read(path) for path in snakemake.input if path.endswith(".csv")}
    for name, (figure, table) in FIGURES.items():
        style.save(figure.draw(read[table]), Path(snakemake.output[0]).with_name(name))
