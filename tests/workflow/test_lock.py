"""environment.lock pins everything with hashes, and says nothing of where it was made."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
LOCK = (ROOT / "environment.lock").read_text()


def test_it_holds_no_address_and_no_path():
    assert not re.search(r"://|file:/|--index-url|--extra-index|--find-links|--trusted-host|^-e|(\s|@)/\w", LOCK, re.M)


def test_every_package_has_an_exact_version_and_a_hash():
    blocks = re.findall(r"^[a-z0-9].*(?:\n +--hash.*)+", LOCK, re.M)
    assert all(re.match(r"[a-z0-9-]+==[\w.]+ \\\n +--hash=sha256:[0-9a-f]{64}", block) for block in blocks)
    assert len(blocks) == len(re.findall(r"^[a-z0-9]", LOCK, re.M))


def test_every_direct_dependency_is_locked():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    extras = project["project"]["optional-dependencies"].values()
    wanted = [*project["project"]["dependencies"], *(name for extra in extras for name in extra)]
    wanted += project["build-system"]["requires"]
    locked = set(re.findall(r"^([a-z0-9-]+)==", LOCK, re.M))
    assert {re.split(r"[<>=]", name)[0] for name in wanted} <= locked
