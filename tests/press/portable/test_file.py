"""Portable model files: what is refused, and in which words."""

import struct

import pytest
from press.portable.conftest import headed, repaired

from palpate.cli import main
from palpate.errors import InputError
from palpate.press.portable.file import FOUR_ERRORS, describe, read


@pytest.fixture
def written(made_up, tmp_path):
    def write(data):
        (tmp_path / "block.palpate").write_bytes(data)
        return tmp_path / "block.palpate"

    return write


def test_a_whole_file_is_read_and_told(made_up, written, capsys):
    path = written(made_up.data)
    assert read(path).info["body"] == "block"
    assert main(["load", str(path)]) == 0
    said = capsys.readouterr().out
    assert "whole and sound" in said and said.endswith("\n".join(FOUR_ERRORS) + "\n")


def test_places_to_touch_are_told(made_up, written):
    assert "sphere of 15 mm at 1 places, to 6 mm; force within 3 % straight in, 10 %" in describe(
        written(made_up.touched)
    )
    assert "sphere" not in describe(written(made_up.data))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda data: data[:-7], "cut off"),
        (lambda data: data[:40], "no portable model"),
        (lambda data: b"PK\3\4" + data[4:], "no portable model"),
        (lambda data: data[:8] + b"\3" + data[9:], "of version 3, and versions 1 to 2"),
        (lambda data: data[:900] + bytes([data[900] ^ 4]) + data[901:], "checksum"),
        (lambda data: repaired(data + b"more"), "something follows"),
        (lambda data: headed(data, {}), "its header lacks body, which is a text"),
        (lambda data: headed(data, {"body": "a", "regime": "b", "model": "c", "error": 2}), "lacks error"),
        (lambda data: headed(data, []), "not JSON"),
        (lambda data: repaired(data[:-400]), "longer than the file"),
        (lambda data: repaired(data[:36] + struct.pack("<I", 10**6) + data[40:]), "sizes"),
        (lambda data: repaired(data[:48] + struct.pack("<d", float("nan")) + data[56:]), "not finite"),
    ],
)
def test_what_is_no_model_is_refused_in_one_sentence(change, said, made_up, written, capsys):
    path = written(change(made_up.data))
    with pytest.raises(InputError, match=said):
        read(path)
    assert main(["load", str(path)]) == 1
    printed = capsys.readouterr().err
    assert printed.startswith(f"error: {path}: ") and len(printed.splitlines()) == 1


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"nothing\.palpate cannot be read"):
        describe(tmp_path / "nothing.palpate")


@pytest.mark.parametrize(("given", "said"), [("fem_p2", "has no form"), ("unheard", "is not known")])
def test_models_that_no_file_can_hold_are_refused(given, said, tmp_path, capsys):
    out = tmp_path / "out.palpate"
    assert main(["export", "--scene", "liver_large", "--model", given, "--out", str(out)]) == 1
    assert said in capsys.readouterr().err and not out.exists()


def test_a_file_that_cannot_be_written_is_refused_before_anything_is_prepared(tmp_path, capsys):
    (tmp_path / "file").write_text("kept")
    for out in (tmp_path, tmp_path / "file/in.palpate"):
        assert main(["export", "--scene", "liver_large", "--out", str(out)]) == 1
        printed = capsys.readouterr().err
        assert printed.startswith(f"error: {out} cannot be written") and len(printed.splitlines()) == 1
    assert [each.name for each in tmp_path.iterdir()] == ["file"]
