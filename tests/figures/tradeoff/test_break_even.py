"""The number of answers after which preparation has paid is drawn as the table has it."""

from palpate.figures.tradeoff import break_even


def test_preparing_pays_where_the_table_says(advised_tables):
    settings, advised = advised_tables
    axis = break_even.draw(settings, advised).axes[0]
    dots = {line.get_xdata()[0]: line.get_ydata()[0] for line in axis.lines if line.get_marker() == "o"}
    offline, online = 40.0, 5e-3
    answers = offline / (0.4 - online)
    assert {round(x): round(y) for x, y in dots.items()}[round(answers)] == round(0.4 * answers)  # what fine FEM takes
    named = [text.get_text() for text in axis.get_legend().get_texts()]
    assert named[0].startswith("fine FEM (tolerance=1e-08)") and len(named) == 3
