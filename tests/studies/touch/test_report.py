"""What the report says of touches follows from their tables."""

from fixtures.material import failures, numbers, page


def test_what_to_take_within_each_time(touch, touch_truth):
    taken = next(iter(numbers("touch", {"touch": touch, "touch_truth": touch_truth})["taken"].values()))
    taken = taken.set_index("within")
    assert taken["take"].tolist() == ["linear responses with contact"] * 3 + ["locally refined elements"]
    assert taken.loc["any time", "limit [%]"] == 100 * (0.015 + 0.006) and taken.loc["any time", "force [%]"] == -1.0
    assert taken["place prepared in"].tolist() == ["2\u00a0s"] * 3 + ["–"]


def test_what_has_no_answer_in_time_is_said(touch, touch_truth):
    slow = touch[touch["model"].isin(["fem", "truth"])]
    taken = next(iter(numbers("touch", {"touch": slow, "touch_truth": touch_truth})["taken"].values()))
    assert taken["take"].tolist()[:2] == ["none", "none"]
    assert taken["setting"].iloc[0] == "fastest: 24\u00a0ms"


def test_touches_without_a_truth_and_without_an_answer_are_listed(touch, touch_truth):
    tables = {"touch": touch, "touch_truth": touch_truth}
    assert "3 touches, 4 mm deep" in page("touch", tables)
    assert "1 more have no truth (1 no answer on a mesh)" in page("touch", tables)
    failed = failures("touch", tables)
    assert len(failed) == 4 and failed[0][1] == "liver under a sphere of 8 mm"
    assert failed[0][0] == "linear responses with contact (places=few)" and "1 of 4 touches: lost" in failed[0][2]


def test_a_scene_in_which_nothing_is_known_is_told(touch, touch_truth):
    lost = touch_truth.assign(samples=0, rejected=4, why_rejected="4 too far apart", force_error=float("nan"))
    lost[["depth_min_m", "depth_max_m"]] = float("nan")
    nothing = touch.assign(samples=0, force_error_size=float("nan"), force_error_p95=float("nan"))
    text = page("touch", {"touch": nothing, "touch_truth": lost})
    assert "none of 8 settings tell the force" in text and "4 more have no truth (4 too far apart)" in text
