"""What a file of settings may hold, and the sentence for what it may not; its files are found from everywhere."""

import re
from pathlib import Path

import pytest
import yaml

from palpate.bodies.settings import paths_of_body
from palpate.errors import InputError
from palpate.run.settings_yaml import read_settings

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
    assert read("a: [yes, off, 1:30, 2020-01-01, 3 kPa]")["a"] == ["yes", "off", "1:30", "2020-01-01", "3 kPa"]
    assert read("a: [true, False, null, ~, .inf]")["a"] == [True, False, None, None, float("inf")]
    assert read("on: 1\n1: 2\n") == {"on": 1, "1": 2}


def test_what_is_said_once_can_be_used_again(read):
    assert read("a: &soft {e: 1, n: 0.3}\nb: {<<: *soft, e: 2}\n")["b"] == {"e": 2, "n": 0.3}


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("a:\n\tb: 1\n", "my.yaml: line 2, column 1 has a tab; indent with spaces."),
        ("a: 1\n b: 2\n", "my.yaml: line 2, column 3 is not YAML (mapping values are not allowed here); give one key"),
        ("a: [1, 2\nb: 3\n", "my.yaml: line 2, column 2 is not YAML (expected ',' or ']', but got ':', while"),
        ("a: 'b\n", "my.yaml: line 2, column 1 is not YAML (found unexpected end of stream, while scanning a quoted"),
        ("a:\n   b: 1\n  c: 1\n", "my.yaml: line 3, column 3 does not continue the block of line 1; indent"),
        ("a: *soft\n", "my.yaml: line 1, column 4 is not YAML (found undefined alias 'soft'); check"),
        (ASKED + "a: 3\n", "my.yaml: line 3 has the key a again, which line 1 has; remove or rename one of them."),
        ("a: {b: 1, b: 2}\n", "my.yaml: line 1 has the key b again, which line 1 has;"),
        ("[a]: 1\n", "my.yaml: line 1 has brackets where a key belongs; write a name."),
        ("a: &a {b: *a}\n", "my.yaml has an entry that holds itself; write out what its * refers to."),
        ("a: !!python/name:os.system {}\n", "my.yaml: line 1, column 4 is not YAML (could not determine a constructor"),
        ("", "my.yaml is empty; give it bodies, and the block of a study."),
        ("- a\n- b\n", "my.yaml holds a list, and must hold keys such as bodies: at the beginning of its lines."),
        ("bodies\n", "my.yaml holds a text, and must hold keys"),
        (b"a: 1\nb: \xe4\n", "my.yaml: line 2 is not UTF-8; save the file with that encoding."),
        (b"a: 1\nb: \x00\n", "my.yaml: line 2 has a character that cannot be printed; remove it."),
    ],
)
def test_what_cannot_be_read_is_one_sentence_with_its_line(read, content, said):
    with pytest.raises(InputError) as caught:
        read(content)
    assert str(caught.value).startswith(said)
    assert str(caught.value).endswith(".") and "\n" not in str(caught.value)


@pytest.mark.parametrize(("name", "said"), [("my.yaml", "my.yaml is missing; give"), (".", ". cannot be read (Is a")])
def test_what_is_no_file_is_one_sentence(tmp_path, monkeypatch, name, said):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=f"^{re.escape(said)}"):
        read_settings(Path(name))


def test_paths_are_of_the_folder_of_the_settings():
    given = {"kind": "file", "path": "../organ.stl", "image": None, "law": "own/law.py"}
    assert paths_of_body(given, Path("/a/b")) == {"path": "/a/organ.stl", "law": "/a/b/own/law.py"}
    assert paths_of_body({"kind": "liver", "law": "corotational"}, Path("/a")) == {}
