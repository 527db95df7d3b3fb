"""Sentences about scaling follow from its table."""

from fixtures.material import numbers


def test_the_caption_names_the_largest_body(scaling_table):
    said = numbers("scaling", {"scaling": scaling_table})
    assert said["scaling_elements"] == "1,000,000"
    assert said["headline"] == (
        "A press of 1,000,000 tetrahedra takes 20 s and 5 GB on one core; "
        "the time grows with the number of elements to the power of 1.07."
    )
    assert said["scaling_whole"] == "to the power of 1.00"  # of all stages, proportional in this table
    assert said["scaling_cores"] == "2 cores are 2 times as fast as one"


def test_one_core_has_no_speed_up(scaling_table):
    alone = scaling_table[(scaling_table["component"] != "cores") | (scaling_table["size"] == 1)]
    assert numbers("scaling", {"scaling": alone})["scaling_cores"] == "there is one core only"
