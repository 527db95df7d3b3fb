"""Say in one sentence what this system lacks for the environment to be built.

Run by the system's own Python, perhaps an old one, before anything is installed: standard library only, and no
syntax newer than Python 3.6's.
"""

import ctypes
import shutil
import sys
from importlib.util import find_spec

OLDEST = (3, 11)
DISK_GB = 2.2
"""What the environment takes, with what pip unpacks on the way."""
# the Makefile reads the packages from these lines where there is no Python to run this file
LIBRARIES = {
    "libEGL.so.1": "libegl1",
    "libGL.so.1": "libgl1",
    "libGLU.so.1": "libglu1-mesa",
    "libX11.so.6": "libx11-6",
    "libXcursor.so.1": "libxcursor1",
    "libXext.so.6": "libxext6",
    "libXfixes.so.3": "libxfixes3",
    "libXft.so.2": "libxft2",
    "libXinerama.so.1": "libxinerama1",
    "libXrender.so.1": "libxrender1",
    "libfontconfig.so.1": "libfontconfig1",
    "libgomp.so.1": "libgomp1",
}
"""The libraries that Gmsh and VTK load, and the Debian package of each."""


def loads(library: str) -> bool:
    """Whether a shared library can be loaded."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def missing() -> str:
    """One sentence about what is missing, and how to get it; empty if nothing is."""
    version = sys.version_info[:2]
    if version < OLDEST:
        needed, found = (".".join(map(str, numbers)) for numbers in (OLDEST, version))
        return f"palpate needs Python {needed} or newer, and this is {found}; name another: make PYTHON=python{needed}"
    wanted = {}
    if not (find_spec("venv") and find_spec("ensurepip")):
        wanted["Python's venv"] = "python{}.{}-venv".format(*version)
    if sys.platform == "linux":
        wanted.update((library, package) for library, package in LIBRARIES.items() if not loads(library))
    if wanted:
        if shutil.which("apt-get"):
            advice = "apt-get install " + " ".join(wanted.values())
        else:
            advice = "install the packages of your system that hold them"
        return f"palpate needs {', '.join(wanted)}, which this system lacks: {advice}"
    left_gb = shutil.disk_usage(".").free / 1e9
    if left_gb < DISK_GB:
        return f"palpate's environment needs {DISK_GB} GB of disk, and {left_gb:.1f} GB are left here"
    return ""


if __name__ == "__main__":
    sys.exit(missing() or None)
