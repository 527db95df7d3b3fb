"""Models are compared on the front of a scene only above the error of the truth itself."""

from palpate.benchmark.ranking import averaged, own_error
from palpate.report import tables
from palpate.studies.tradeoff.figures.scene_rows import front_rows


def test_below_the_truths_own_error_models_are_tied_and_the_fastest_stays(trade_off_tables):
    settings = averaged(tables.where(trade_off_tables["accuracy_vs_time"], scene="liver_small"))
    assert own_error(settings) == 0.0009 and own_error(settings, "patch_rms_of_peak") == 0.003
    before = list(front_rows(settings)["model"])
    assert before[-1] == "detail_correction"
    settings.loc[settings["model"] == "truth", "rmse_of_peak"] = 0.01
    after = list(front_rows(settings)["model"])
    assert after == ["linear_fem", "linear_residual"]


def test_each_error_has_its_own_front_without_the_truth_and_the_zero_answer(trade_off_tables):
    table = trade_off_tables["accuracy_vs_time"]
    for scene in tables.scenes(table):
        assert not {"truth", "zero"} & set(front_rows(averaged(tables.where(table, scene=scene)))["model"])
    settings = averaged(tables.where(table, scene="liver_large"))
    fronts = [list(front_rows(settings, column)["model"]) for column in ("rmse_of_peak", "patch_rms_of_peak")]
    assert fronts[0] != fronts[1]
