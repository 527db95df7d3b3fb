"""The work–precision diagram of enrichment names failures and frame budgets."""

from fixtures.drawn import texts

from palpate.studies.enrichment.figures import charts


def test_failures_and_budgets_are_named(results):
    tables = (results[n] for n in ("enrichment_accuracy", "online_cost", "fem_cost"))
    figure = charts.draw_accuracy_vs_online_cost(*tables)
    assert len(figure.axes) == 4 * 2
    assert texts(figure).count("failed: POD + RBF") == 4
    assert {"1 ms", "16.7 ms", "100 ms", "fine FEM", "Pareto front"} <= set(texts(figure))
