"""The advised model of each budget is drawn with the next best."""

from fixtures.drawn import texts

from palpate.figures.tradeoff import advice


def test_advice_shows_the_advised_and_the_next_best_in_each_budget(advised_tables):
    settings, advised = advised_tables
    figure = advice.draw(advised, settings)
    titles = [axis.get_title("left") for axis in figure.axes]
    assert titles == ["within 0.01 ms", "within 1 ms", "within 16.7 ms", "within 1000 ms"]
    none, first, *_ = ([text.get_text() for text in axis.texts] for axis in figure.axes)
    assert none == ["none", "none"]
    assert first == ["shape matching: 4×", "linear fine FEM"] * 2


def test_own_models_are_drawn_wherever_they_come(advised_tables):
    settings, advised = (
        table.replace({"detail_correction": "mine", "shape_matching": "nearest", "linear_fem": "other"})
        for table in advised_tables
    )
    assert "nearest" in "".join(texts(advice.draw(advised, settings)))
