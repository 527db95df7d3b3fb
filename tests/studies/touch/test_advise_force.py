"""The command's advice by the error of an instrument's force."""

import numpy as np
import pytest

from palpate.cli import main


@pytest.fixture
def ask(touch, tmp_path, capsys):
    """What ``palpate advise --error force`` returns and says."""
    (tmp_path / "tables").mkdir()
    touch.to_csv(tmp_path / "tables/touch.csv", index=False)

    def asked(*words: str) -> tuple[int, str]:
        code = main(["advise", "--results", str(tmp_path), "--error", "force", *words])
        said = capsys.readouterr()
        return code, (said.out + said.err).replace("\u00a0", " ")

    return asked


def test_the_force_is_told_with_its_limit_and_the_own_error(ask):
    code, said = ask("--scene", "liver_sphere_8mm", "--budget-ms", "1")
    assert code == 0 and said.startswith("liver_sphere_8mm, within 1 ms: ") and "places=all\n" in said
    assert "9 % of the force on average, by 9 % too large with its sign; surface 5 %, in the dent 15 %" in said
    assert "14 % at the 95th percentile of 4 touches, which are too few for a bound" in said
    assert "2 s for a new place" in said


def test_all_scenes_are_advised_and_what_keeps_no_limit_has_a_nearest(ask):
    code, said = ask("--max-error", "0.01")
    assert code == 0 and said.count(", error of at most 1 %: none\n") == 2
    assert said.count("finite elements (held=1, level=4), 95 % of the touches below 2.1 % (4 touches)") == 2
    assert ask()[1].count("whatever time it takes: fem held=1, level=4") == 2


@pytest.mark.parametrize(
    ("words", "refused"),
    [
        (["--scene", "liver"], "; choose from liver_sphere_8mm, cylinder_punch_8mm."),
        (["--speed", "20"], "cylinder_punch_8mm: what is pressed and does not move has no speed; leave --speed out."),
        (["--load", "all"], "--error force is of instruments that are pushed to a depth or moved; leave --load out."),
    ],
)
def test_what_cannot_be_asked_is_refused(ask, words, refused):
    code, said = ask(*words)
    assert code == 1 and said.endswith(f"{refused}\n") and said.count("\n") == 1


def test_a_scene_that_moves_is_advised_by_the_force_that_its_models_feel(ask, dynamic_table, tmp_path):
    feels = dynamic_table["scene"].eq("liver_press") & dynamic_table["model"].eq("fem_fine")
    table = dynamic_table.assign(
        force_rms_of_peak=(3.0 * dynamic_table["rmse_of_peak"]).where(feels),
        force_peak_error=-0.02,
        reference="fem_p2",
        reference_force_error=0.004,
        estimate_of_peak=np.nan,
    )
    table.to_csv(tmp_path / "tables/dynamic_accuracy.csv", index=False)
    code, said = ask("--scene", "liver_press", "--max-error", "0.04")
    # the coarser step has 6 %, and springs of 5 % of the displacement feel nothing
    assert code == 0 and said.startswith("liver_press, error of at most 4 %: fem_fine step_s=0.01\n")
    assert "3 % of the peak force over the whole motion, from a standard that is 0.4 % wrong itself" in said
    assert "the largest force is 2 % too small" in said
    assert ask("--scene", "liver_press", "--max-error", "0.033")[1].startswith(
        "liver_press, error of at most 3.3 %: none"
    )
    assert ask("--scene", "bar_sag", "--speed", "1")[0] == 1
    assert "liver_press, 0.01 × real time: " in ask("--speed", "0.01")[1]
