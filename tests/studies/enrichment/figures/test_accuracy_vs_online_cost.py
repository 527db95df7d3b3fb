"""The work–precision diagram of enrichment names failures and frame budgets."""

from fixtures.drawn import texts

from palpate.studies.enrichment.figures import accuracy_vs_online_cost


def test_failures_and_budgets_are_named(results):
    tables = (results[n] for n in ("enrichment_accuracy", "online_cost", "fem_cost"))
    figure = accuracy_vs_online_cost.draw(*tables)
    assert len(figure.axes) == 4 * 2
    assert texts(figure).count("failed: POD + RBF") == 4
    assert {"1 ms", "16.7 ms", "100 ms", "fine FEM", "Pareto front"} <= set(texts(figure))
