"""Files of a body are found from wherever a command is called."""

from pathlib import Path

from palpate.bodies.settings import paths_of_body


def test_paths_are_of_the_folder_of_the_settings():
    given = {"kind": "file", "path": "../organ.stl", "image": None, "law": "own/law.py"}
    assert paths_of_body(given, Path("/a/b")) == {"path": "/a/organ.stl", "law": "/a/b/own/law.py"}
    assert paths_of_body({"kind": "liver", "law": "corotational"}, Path("/a")) == {}
