"""Say what this system lacks for the environment to be built: run by its own Python, perhaps an old one."""

import os
import sys
from ctypes.util import find_library

PACKAGES = ["egl1", "gl1", "glu1-mesa", "x11-6", "xcursor1", "xext6", "xfixes3", "xft2", "xinerama1", "xrender1"]
NAMES = ["EGL", "GL", "GLU", "X11", "Xcursor", "Xext", "Xfixes", "Xft", "Xinerama", "Xrender", "fontconfig", "gomp"]
"""What Gmsh and VTK load."""
found = dict(zip(NAMES, [*PACKAGES, "fontconfig1", "gomp1"]))  # noqa: B905, as strict= is not older Pythons'
lacking = ["lib" + package for name, package in found.items() if not find_library(name)]
if sys.version_info < (3, 11):  # noqa: UP036
    sys.exit("palpate needs Python 3.11 or newer; name one: make PYTHON=python3.11")
if set(os.getcwd()) & set(" $`'\"\\;&|<>(){}*?!#"):
    sys.exit("snakemake cannot start Python in a folder whose name has a space, a quote or a sign of the shell")
if lacking and sys.platform == "linux":
    sys.exit("Gmsh and VTK need libraries that this system lacks; on Debian: apt-get install " + " ".join(lacking))
