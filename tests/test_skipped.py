"""The end of a test run says in one line what was not tested."""

from pathlib import Path
from types import SimpleNamespace

import pytest


@pytest.fixture
def summary(pytestconfig):
    """What is said about reports that were ``skipped`` for these reasons."""
    conftest = next(p for p in pytestconfig.pluginmanager.get_plugins() if _is_ours(p))

    def say(*reasons: str) -> list[str]:
        reports = [SimpleNamespace(longrepr=("test.py", 1, f"Skipped: {reason}")) for reason in reasons]
        said = []
        stats = {"skipped": reports} if reports else {}
        conftest.pytest_terminal_summary(SimpleNamespace(stats=stats, write_line=said.append))
        return said

    return say


def _is_ours(plugin) -> bool:
    return getattr(plugin, "__file__", None) == str(Path(__file__).with_name("conftest.py"))


def test_reasons_are_counted(summary):
    assert summary("no CT", "Chromium is missing: apt-get install chromium", "no CT") == [
        "3 tests skipped: no CT (2); Chromium is missing: apt-get install chromium (1)"
    ]


def test_nothing_is_said_where_nothing_was_skipped(summary):
    assert summary() == []
