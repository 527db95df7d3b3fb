"""Settings of the study that a schema cannot refuse."""

from pathlib import Path

import pytest
from fixtures.bodies import LIVER, SPOT

from palpate.errors import InputError
from palpate.studies.law.settings import changes_of, check, compared_bodies

CUBE = LIVER.but(refinements=0)
BODIES = {"liver": LIVER, "cube": CUBE}
SETTINGS = {"bodies": None, "regions_of": [], "laws": ["corotational"], "radius_of_body_m": {}}


def config(**changes):
    return {"bodies": BODIES, "law": SETTINGS | changes}


def test_of_some_bodies_only_the_regions_are_left_out():
    assert compared_bodies(config()) == ["liver"] and compared_bodies(config(bodies=["cube"])) == ["cube"]
    bodies = BODIES | {"lump": LIVER.but(regions=SPOT)}
    more = {"poissons": [0.3, 0.49], "contacts": 2}
    asked = {"bodies": bodies, "law": SETTINGS | more | {"bodies": ["liver"], "regions_of": ["lump"]}}
    assert compared_bodies(asked) == ["liver", "lump"]
    assert changes_of(asked, "liver") == more | {"laws": ["corotational"]}
    assert changes_of(asked, "lump") == {"laws": [], "poissons": [], "contacts": 0}
    asked["law"]["bodies"] = None  # all that are refined
    assert compared_bodies(asked) == ["liver", "lump"] and changes_of(asked, "lump")["contacts"] == 2


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
        check(config(**changes), Path("config.yaml"))


def test_a_law_of_ones_own_is_a_file_beside_the_settings(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text("def shape(): ...\ndef measure(): ...\n")
    with pytest.raises(InputError, match=r"law\.laws: .*mine\.py has no function volume"):
        check(config(laws=["mine.py"]), tmp_path / "config.yaml")
    file.write_text(file.read_text() + "def volume(): ...\n")
    check(config(laws=["corotational", "mine.py"]), tmp_path / "config.yaml")


def test_a_body_that_is_refined_is_needed():
    with pytest.raises(InputError, match="law is there and no body is refined"):
        check(config() | {"bodies": {"cube": CUBE}}, Path("config.yaml"))
