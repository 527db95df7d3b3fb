"""The lock files pin everything with hashes, agree, and say nothing of where they were made."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LOCK = (ROOT / "environment.lock").read_text()
TOOLS = (ROOT / "tests/environment.lock").read_text()
"""What tests and checks need besides."""


def versions(lock: str) -> dict[str, str]:
    return dict(re.findall(r"^([a-z0-9-]+)==([\w.]+)", lock, re.M))


@pytest.mark.parametrize("lock", [LOCK, TOOLS])
def test_it_holds_no_address_and_no_path(lock):
    assert not re.search(r"://|file:/|--index-url|--extra-index|--find-links|--trusted-host|^-e|(\s|@)/\w", lock, re.M)


@pytest.mark.parametrize("lock", [LOCK, TOOLS])
def test_every_package_has_an_exact_version_and_a_hash(lock):
    blocks = re.findall(r"^[a-z0-9].*(?:\n +--hash.*)+", lock, re.M)
    assert all(re.match(r"[a-z0-9-]+==[\w.]+ \\\n +--hash=sha256:[0-9a-f]{64}", block) for block in blocks)
    assert len(blocks) == len(re.findall(r"^[a-z0-9]", lock, re.M))


def test_the_locks_agree():
    base, tools = versions(LOCK), versions(TOOLS)
    assert {name: tools[name] for name in tools.keys() & base} == {name: base[name] for name in tools.keys() & base}


def test_every_direct_dependency_is_locked():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    extras = project["project"]["optional-dependencies"]
    wanted = [*project["project"]["dependencies"], *project["build-system"]["requires"]]
    wanted += [*extras["bench"], *extras["cluster"]]
    assert {re.split(r"[<>=]", name)[0] for name in wanted} <= versions(LOCK).keys()
    assert set(extras["dev"]) <= versions(TOOLS).keys()
