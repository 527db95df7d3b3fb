"""The small diagram shows the models on the front, and everything else in grey."""

from fixtures.drawn import texts

from palpate.figures import style
from palpate.figures.model_looks import look
from palpate.figures.tradeoff import best_models


def test_the_front_is_numbered_and_named(advised_tables, tmp_path):
    figure = best_models.draw(*advised_tables, scene="liver_small")
    written = [text.replace("\u00a0", " ") for text in texts(figure)]
    assert [text for text in written if text.isdigit() and len(text) == 1] == ["1", "2", "3", "4", "5"]
    assert "1  linear fine FEM: 5 % in 10 µs" in written and "5  fine FEM: < 0.001 % in 400 ms" in written
    assert "16.7 ms" in written
    style.save(figure, tmp_path / "best_models")


def test_only_the_front_is_coloured(advised_tables):
    axis = best_models.draw(*advised_tables, scene="liver_small").axes[0]
    large = [line.get_color() for line in axis.lines if line.get_markersize() > 10]
    names = ("linear_fem", "pod_rbf", "detail_correction", "fem_coarse", "fem_fine")
    assert large == [look(name).colour for name in names]
    (grey,) = (line for line in axis.lines if line.get_markersize() == 3)
    assert len(grey.get_xdata()) == 7  # the setting that failed on some samples, and the reference, have no place


def test_it_is_as_wide_as_a_telephone(advised_tables):
    figure = best_models.draw(*advised_tables, scene="liver_small")
    assert 96 * figure.get_figwidth() < 390 - 32
