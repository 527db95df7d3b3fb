"""What the report says of touches follows from their tables."""

from fixtures.material import numbers


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
