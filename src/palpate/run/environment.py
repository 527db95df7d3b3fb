"""Check that the environment holds what palpate needs."""

import re
from importlib.metadata import PackageNotFoundError, requires, version

from palpate.errors import InputError


def check_environment() -> None:
    """Raise InputError naming the packages that palpate needs and that are not installed."""
    if not _installed("palpate"):  # but found by its path
        return
    missing = []
    for wanted in requires("palpate") or []:
        name = re.split(r"[<>=; \[]", wanted)[0]
        if "extra ==" not in wanted and not _installed(name):
            missing.append(name)
    if missing:
        raise InputError(
            f"the environment lacks {', '.join(missing)}; type make distclean, and then make, which builds it anew."
        )


def _installed(name: str) -> bool:
    try:
        return bool(version(name))
    except PackageNotFoundError:
        return False
