from palpate.figures import style, tables
from palpate.figures.enrichment import accuracy_vs_online_cost, complexity, fem_cost, timing_bars
from palpate.job import job, stem

with job(snakemake.log[0]):
    names = ("timing", "complexity", "accuracy", "online", "fem", "peaks")
    table, out = {name: tables.read(snakemake.input[name]) for name in names}, snakemake.output
    style.save(timing_bars.draw(table["timing"]), stem(out.timing))
    style.save(complexity.draw(table["complexity"]), stem(out.complexity))
    style.save(accuracy_vs_online_cost.draw(table["accuracy"], table["online"], table["fem"]), stem(out.tradeoff))
    style.save(fem_cost.draw(table["fem"], table["peaks"]), stem(out.fem))
