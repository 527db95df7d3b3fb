"""Sentences about scaling follow from its table."""

from palpate.report.parts import scaling_numbers


def test_the_caption_names_the_largest_body(scaling_table):
    said = scaling_numbers.numbers({"scaling": scaling_table})
    assert said["scaling_elements"] == "1,000,000"
    assert said["headline_scaling"] == (
        "A press of 1,000,000 tetrahedra takes 20\u00a0s and 5 GB on one core; "
        "the time grows with the elements to the power of 1.07."
    )
    assert said["scaling_whole"] == "to the power of 1.00"  # of all stages, proportional in this table
    assert said["scaling_cores"] == "2 cores are 2 times as fast as one"


def test_one_core_has_no_speed_up(scaling_table):
    assert (
        scaling_numbers.numbers(
            {"scaling": scaling_table[(scaling_table["component"] != "cores") | (scaling_table["size"] == 1)]}
        )["scaling_cores"]
        == "there is one core only"
    )
