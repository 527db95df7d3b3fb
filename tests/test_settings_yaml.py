"""What a file of settings may hold, and the sentence for what it may not; its files are found from everywhere."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from pydantic import ValidationError

import palpate as pp
from palpate.bodies.settings import Anchors, File
from palpate.errors import InputError
from palpate.run.settings import read_settings

ROOT = Path(__file__).parents[1]
ASKED = "a: 1\nb: 2\n"


@pytest.fixture
def read(tmp_path, monkeypatch):
    """Write a file of settings, text or bytes, and read it."""
    monkeypatch.chdir(tmp_path)

    def written(content: str | bytes) -> dict:
        path = Path("my.yaml")
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_settings(path)

    return written


@pytest.mark.parametrize("name", ["config.yaml", "tests/smoke/config.yaml", "docs/example_ct.yaml"])
def test_shipped_settings_are_read_as_any_yaml_reader_does(name):
    assert read_settings(ROOT / name) == yaml.safe_load((ROOT / name).read_text())


def test_numbers_are_those_of_yaml_1_2(read):
    assert read("a: [1e-8, 3.0e3, 3E+3, .5, 2., 010, -5, +3]")["a"] == [1e-8, 3000, 3000, 0.5, 2.0, 10, -5, 3]
    assert read("a: [1:30, 3 kPa, 3_000]")["a"] == ["1:30", "3 kPa", "3_000"]
    assert read("a: [true, False, null, ~, .inf]")["a"] == [True, False, None, None, float("inf")]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("a:\n\tb: 1\n", "my.yaml: line 2 has "),
        ("a: [1, 2\nb: 3\n", "my.yaml: line 2 has expected ',' or ']'"),
        ("a: *soft\n", "my.yaml: line 1 has found undefined alias"),
        (ASKED + "a: 3\n", "my.yaml: line 3 has the key a again"),
        ("[a]: 1\n", "my.yaml: line 1 has brackets where a key belongs"),
        ("a: !!python/name:os.system {}\n", "my.yaml: line 1 has could not determine a constructor"),
        ("", "my.yaml has no keys"),
        (b"a: 1\nb: \xe4\n", "my.yaml cannot be read ("),
    ],
)
def test_what_cannot_be_read_is_one_sentence_with_its_line(read, content, said):
    with pytest.raises(InputError) as caught:
        read(content)
    assert str(caught.value).startswith(said)
    assert str(caught.value).endswith(".") and "\n" not in str(caught.value)


@pytest.mark.parametrize(("name", "said"), [("my.yaml", "my.yaml cannot be read ("), (".", ". cannot be read (")])
def test_what_is_no_file_is_one_sentence(tmp_path, monkeypatch, name, said):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=f"^{re.escape(said)}"):
        read_settings(Path(name))


def test_paths_are_of_the_folder_of_the_settings():
    given = File(path="../organ.stl", law="own/law.py", young_pa=3000, poisson=0.3)
    assert given.paths(Path("/a/b")) == {"path": "/a/organ.stl", "law": "/a/b/own/law.py"}
    assert given.but(law="corotational").paths(Path("/a/b")) == {"path": "/a/organ.stl"}


BOX = {"sizes_m": [1, 1, 1], "divisions": [3, 3, 3], "poisson": 0.3}


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: pp.Box(**BOX, youngs_pa=1), "Box has an unknown key youngs_pa; did you mean young_pa?"),
        (lambda: pp.Box(**BOX, young_pa=-1), "Box: young_pa is -1: "),
        (lambda: pp.Press(node=1, force_n=1).but(force=3), "Press has an unknown key force; "),
        (lambda: pp.Contact(instruments=[{"kind": "sphere", "radius_m": 1}]), "Contact: instruments[0] lacks center_m"),
        (lambda: Anchors(), "Anchors is {}: must have at least one entry"),
    ],
)
def test_wrong_fields_are_one_sentence_in_python_too(make, said):
    with pytest.raises(InputError) as caught:
        make()
    assert str(caught.value).startswith(said) and "\n" not in str(caught.value)


def test_numbers_of_numpy_become_plain_ones_and_bools_are_none():
    box = pp.Box(**BOX | {"divisions": np.array([3, 2, 1])}, young_pa=np.float32(0.5))
    assert box.divisions == [3, 2, 1] and {type(each) for each in box.divisions} == {int}
    assert {type(each) for each in pp.Sphere(center_m=np.zeros(3), radius_m=np.int64(1)).center_m} == {float}
    for wrong in (np.True_, True, np.array([1, 2]), np.float64(2.5)):
        with pytest.raises(InputError):
            pp.Press(node=wrong, force_n=1)


def test_blocks_inside_others_leave_their_fault_to_the_whole():
    with pytest.raises(ValidationError) as caught:
        pp.Box.model_validate(BOX | {"young_pa": 1, "anchors": [{"nodes": [1]}, {"plane": {"axis": "z"}}]})
    assert {error["loc"][:4] for error in caught.value.errors()} == {("anchors", "several", 1, "plane")}


def test_help_has_every_field_of_every_class():
    for kind in (getattr(pp, name) for name in pp.__all__):
        assert kind.__doc__
        for name, field in getattr(kind, "model_fields", {}).items():
            assert f"\n{name}" in kind.__doc__ and field.description in kind.__doc__
