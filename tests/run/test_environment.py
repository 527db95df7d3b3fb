"""What the environment lacks is named before anything runs."""

import re
from importlib import metadata

import pytest

from palpate.errors import InputError
from palpate.run import system_faults


def test_missing_packages_are_named(monkeypatch):
    system_faults.check_environment()

    def version(name: str) -> str:
        if name in ("h5py", "gmsh"):
            raise metadata.PackageNotFoundError(name)
        return "1.0"

    monkeypatch.setattr(system_faults, "version", version)
    said = "the environment lacks gmsh, h5py; type make distclean, and then make, which builds it anew."
    with pytest.raises(InputError, match=f"^{re.escape(said)}$"):
        system_faults.check_environment()
