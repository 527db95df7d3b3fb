from palpate.figures import style, tables
from palpate.figures.tradeoff import advice, break_even
from palpate.job import job, stem

with job(snakemake.log[0]):
    settings, advised = (tables.read(snakemake.input[name]) for name in ("settings", "advice"))
    style.save(advice.draw(advised, settings), stem(snakemake.output.advice))
    style.save(break_even.draw(settings, advised), stem(snakemake.output.break_even))
