"""Record which state of the code a number came from."""

import subprocess
from importlib.metadata import version
from pathlib import Path


def commit() -> str:
    """Return the short commit of this package's source, with a + where files differ from it; or its version."""
    folder = Path(__file__).parents[1]
    words = ["git", "-C", str(folder), "describe", "--always", "--dirty=+", "--abbrev=12", "--exclude=*"]
    try:
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return version("palpate")
