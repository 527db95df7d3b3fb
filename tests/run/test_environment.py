"""What the environment lacks is named before anything runs."""

import re
from importlib import metadata

import pytest

from palpate.errors import InputError
from palpate.run import environment


def test_missing_packages_are_named(monkeypatch):
    environment.check_environment()

    def version(name: str) -> str:
        if name in ("h5py", "gmsh"):
            raise metadata.PackageNotFoundError(name)
        return "1.0"

    monkeypatch.setattr(environment, "version", version)
    said = "the environment lacks gmsh, h5py; type make distclean, and then make, which builds it anew."
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        environment.check_environment()
