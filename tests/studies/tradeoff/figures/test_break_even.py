"""The number of answers after which preparation has paid is drawn as the table has it."""

from fixtures.trade_off import accuracy_vs_time

from palpate.studies.tradeoff.figures import advice


def test_preparing_pays_where_the_table_says(trade_off_tables):
    settings, advised = trade_off_tables["accuracy_vs_time"], trade_off_tables["advice"]
    axis = advice.draw_break_even(settings, advised).axes[0]
    dots = {line.get_xdata()[0]: line.get_ydata()[0] for line in axis.lines if line.get_marker() == "o"}
    offline, online, fine = 9.0, 0.012e-3, 0.45
    answers = offline / (fine - online)
    assert {round(x): round(y) for x, y in dots.items()}[round(answers)] == round(fine * answers)
    named = [text.get_text().replace("\u00a0", " ") for text in axis.get_legend().get_texts()]
    assert named[-1] == "linear fine FEM, 1.7 %" and len(named) == 3


def test_several_splits_have_one_line_for_each_setting(trade_off_tables):
    axis = advice.draw_break_even(accuracy_vs_time((1, 2)), trade_off_tables["advice"]).axes[0]
    named = [text.get_text().rsplit(",", 1)[0] for text in axis.get_legend().get_texts()]
    assert len(named) == len(set(named))


def test_no_line_is_hidden_by_the_names(trade_off_tables):
    figure = advice.draw_break_even(trade_off_tables["accuracy_vs_time"], trade_off_tables["advice"])
    figure.draw_without_rendering()
    for axis in figure.axes:
        assert axis.get_legend().get_window_extent().y1 < axis.get_window_extent().y0


def test_long_names_leave_the_panels_their_width(trade_off_tables):
    settings, advised = (trade_off_tables[name].copy() for name in ("accuracy_vs_time", "advice"))
    for table in (settings, advised):
        table["setting"] += ", modes=snapshots, rings=50, thinned=0.003, target=limit, and as much again"
    figure = advice.draw_break_even(settings, advised)
    figure.draw_without_rendering()
    for axis in figure.axes:
        assert axis.get_position().width > 0.8 / len({each.get_position().x0 for each in figure.axes})
