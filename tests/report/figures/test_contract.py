"""A figure declares the tables that its function draws, by the names of its parameters."""

from importlib import import_module
from inspect import signature

import pytest

from palpate.report import declared

FIGURES = [(study, figure) for study in declared.names() for figure in declared.figures(study).values()]


@pytest.mark.parametrize(("study", "figure"), FIGURES)
def test_a_figure_draws_the_tables_that_it_declares(study, figure):
    module, _, function = figure.place.partition(":")
    parameters = signature(getattr(import_module(module), function)).parameters.values()
    if figure.tables:
        assert tuple(p.name for p in parameters if p.kind is not p.KEYWORD_ONLY) == figure.tables
    assert all(declared.table(name) for name in figure.tables)
