"""Settings of the study that a schema cannot refuse."""

from pathlib import Path

import pytest

from palpate.errors import InputError
from palpate.run.settings import complete
from palpate.studies.law.settings import changes_of, compared_bodies

HELD = {"young_pa": 3000, "poisson": 0.3, "anchors": {"plane": {"axis": "z", "side": "min", "depth_m": 0.01}}}
CUBE = {"kind": "box", "sizes_m": [0.1, 0.1, 0.1], "divisions": [2, 2, 2]} | HELD
SHEET = {"kind": "sheet", "sizes_m": [0.1, 0.1], "divisions": [2, 2], "thickness_m": 0.002} | HELD
LIVER = {"kind": "liver", "length_m": 0.2, "refinements": 2} | HELD
LUMP = LIVER | {"regions": {"a": {"sphere": {"center_m": [0, 0, 0], "radius_m": 0.01}, "young_pa": 9000}}}


def config(law, bodies=None, file=Path("config.yaml")):
    return complete({"bodies": bodies or {"liver": LIVER, "cube": CUBE, "sheet": SHEET}, "law": law}, file)


def test_of_some_bodies_only_the_regions_are_left_out():
    assert compared_bodies(config({})) == ["liver"]
    two = {"liver": LIVER, "lump": LUMP}
    for named, tried in ((["liver"], 0), (None, 2)):  # None: all that are refined
        asked = config({"bodies": named, "regions_of": ["lump"]}, two)
        assert compared_bodies(asked) == ["liver", "lump"]
        changes = changes_of(asked, "lump")
        assert changes.contacts == len(changes.poissons) == tried and changes_of(asked, "liver") == asked.law


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"bodies": ["livre"]}, r"config\.yaml: law\.bodies names livre, which is unknown; did you mean liver\?"),
        ({"bodies": ["cube"]}, r"law\.bodies names cube, which is not refined; give it refinements of at least 1"),
        ({"regions_of": ["cube"]}, r"law\.bodies names cube, which is not refined"),
        ({"regions_of": ["liver"]}, r"law\.regions_of names liver, which has no regions; give it some, or remove it"),
        ({"laws": ["neo_hokean"]}, r"law\.laws names neo_hokean, which is unknown; did you mean neo_hookean\?"),
        ({"laws": ["exponential"]}, r"law\.laws names exponential, .*; did you mean exponential\(8\)\?"),
        ({"laws": ["mine.py"]}, r"law\.laws is mine\.py, where there is no file"),
        ({"radius_of_body_m": {"livr": 0.01}}, r"law\.radius_of_body_m names livr, which is unknown"),
    ],
)
def test_each_mistake_is_one_sentence(changes, said):
    with pytest.raises(InputError, match=said):
        config(changes)


def test_a_law_of_ones_own_is_a_file_beside_the_settings(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text("def shape(): ...\ndef measure(): ...\n")
    with pytest.raises(InputError, match=r"law\.laws: .*mine\.py has no function volume"):
        config({"laws": ["mine.py"]}, file=tmp_path / "config.yaml")
    file.write_text(file.read_text() + "def volume(): ...\n")
    config({"laws": ["corotational", "mine.py"]}, file=tmp_path / "config.yaml")


def test_a_body_that_is_refined_is_needed():
    with pytest.raises(InputError, match="law is there and no body is refined"):
        config({}, {"cube": CUBE})
