"""A portable model of a block, made up of cells that nothing was solved for, and the C runtime compiled."""

import json
import shutil
import struct
import subprocess
import zlib
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import palpate.press.portable.runtimes
from palpate.bodies.settings import Box, Plane
from palpate.effects.instrument import Instrument, upright
from palpate.effects.law import PLAIN
from palpate.models.contact_modes.contact_modes import Prepared
from palpate.models.kinds import ContactModes
from palpate.models.reduced.cubature_points import CubaturePoints
from palpate.models.reduced.energy import ReducedEnergy, softness
from palpate.press.portable.export import export_model
from palpate.press.portable.file import read
from palpate.press.portable.runtimes.palpate_model import HEAD, KINDS, SCALARS, PortableModel, TouchPlace
from palpate.press.portable.write import PackedContact, model_bytes, surface_basis

MODEL = ContactModes(thinned=0.01)
RUNTIMES = Path(palpate.press.portable.runtimes.__file__).parent
HERE = Path(__file__).parent
FLAGS = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"]
CHECKS = ["-g", "-O2", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]


class MadeUp(NamedTuple):
    """The bytes of a file, the reduced contacts that are in it, and the bytes with places to touch."""

    data: bytes
    contacts: list[ReducedEnergy]
    touched: bytes


@pytest.fixture(scope="session")
def made_up():
    """A block of 10 cm whose contacts have six coordinates and five cells each."""
    entry = Box(sizes_m=[0.1, 0.1, 0.1], divisions=[2, 2, 2], refinements=1, young_pa=3000, poisson=0.3)
    body, rng = entry.but(anchors=Plane(axis="z", side="min", depth_m=0.001)).make("block"), np.random.default_rng(3)
    nodes, normals = body.fine.nodes[body.fine.surface], body.fine.normals[body.fine.surface]
    n = len(nodes)
    phases = range(12)
    waves = np.dstack([np.sin(nodes @ rng.normal(0, 20, 3) + k)[:, None] * rng.normal(size=3) for k in phases])
    linear = [0.02 * waves[:, :, 3 * k : 3 * k + 3].reshape(3 * n, 3) for k in range(3)]
    packed, contacts = [], []
    for k, at in enumerate(np.flatnonzero(nodes[:, 2] > 0.099)[::4][:6]):
        slopes, volumes = 0.6 * rng.normal(size=(9, 5, 6)), rng.uniform(1e-5, 1e-4, 5)
        points = CubaturePoints(slopes, volumes, np.full(5, 1154.0), np.full(5, 1731.0))
        reduced = ReducedEnergy(points, 0.3 * rng.normal(size=(6, 3)), PLAIN)
        rest = (0.05 * waves.reshape(3 * n, 12)[:, rng.permutation(12)[:6]]).astype(np.float32)
        bearing = -normals[at][None] / 0.8
        turned = np.eye(3), np.eye(3, 6)
        soft, none = softness(rest.reshape(n, 3, 6)), np.zeros(3)
        model = Prepared(reduced, 0.4, linear[k % 3], rest, turned, bearing, np.eye(1), soft, 0.0, none)
        packed.append(PackedContact(nodes[at], normals[at], model))
        contacts.append(reduced)
    basis = surface_basis(body, 0.03, linear, [each.prepared.rest for each in packed], 10)
    scalars = dict.fromkeys(SCALARS, 0.0) | {"radius_m": 0.03, "guard": 0.68, "far": 2.0, "hard": 1.05}
    scalars |= {"farthest_m": 0.1, "floor": 0.01, "share": 0.05, "spread": 0.5, "several": 0.2, "hardest_n": 0.8}
    compliance = 0.01 * np.cov(rng.normal(size=(10, 40)))
    info = {"format": "palpate portable model", "version": 1, "body": "block", "regime": "large", "model": "made up"}
    info |= {"radius_m": 0.03, "peak_m": 0.01, "hardest_n": 0.8, "error": "not measured"}
    at = int(np.argmin(np.linalg.norm(nodes - [0.05, 0.05, 0.1], axis=1)))
    places = [made_up_place(rng, nodes, at, kind) for kind in KINDS]
    files = [model_bytes(info, scalars, basis, compliance, packed, touches) for touches in ((), places)]
    return MadeUp(files[0], contacts, files[1])


def made_up_place(rng, nodes, at, kind):
    """A place on the flat top with six coordinates, bumps of its 81 points, and five cells."""
    axes = upright(Instrument(kind, 0.01), nodes[at], np.array([0.0, 0.0, 1.0])).axes
    across = np.array([[x, y, 0.0] for x in np.linspace(-0.02, 0.02, 9) for y in np.linspace(-0.02, 0.02, 9)])
    points, directions = nodes[at] + across @ axes, np.vstack([axes, axes])
    directions[3:] = axes[2]

    def bumps(places):
        wide = np.array([0.01, 0.012, 0.014, 0.008, 0.02, 0.03])
        size = 0.05 * np.exp(-((np.linalg.norm(places - nodes[at], axis=1)[:, None] / wide) ** 2))
        return (size[:, None] * directions.T).reshape(3 * len(places), 6)

    slopes, volumes = 0.3 * rng.normal(size=(45, 6)), rng.uniform(1e-5, 1e-4, 5)
    sizes = (0.015, 0.015) if kind == "sphere" else (0.012, 0.003)
    told = 0.006, 1.1, 0.01, 0.03, 0.02, 0.1  # deepest, stretched, and errors
    moduli = volumes, np.full(5, 1154.0), np.full(5, 1731.0)
    contact = points.ravel(), bumps(points), np.full(81, 2.5e-5), np.full(81, 1.2e7)
    starts = 0.7 * rng.uniform(-1.0, 1.0, size=(8, 3)) - [0.0, 0.0, 0.3], 0.02 * rng.normal(size=(8, 6))
    arrays = axes, 1e-4 * rng.normal(size=6), *told, np.eye(6), *moduli, slopes, *contact, *starts, bumps(nodes)
    return TouchPlace(at, kind, *sizes, *arrays)


def repaired(data):
    return data[:12] + struct.pack("<2I", len(data), zlib.crc32(data[20:])) + data[20:]


def headed(data, info):
    """The bytes of a file with another header."""
    size, text = struct.unpack_from("<I", data, 20)[0], json.dumps(info).encode()
    text += b" " * (-len(text) % 4)
    return repaired(data[:20] + struct.pack("<I", len(text)) + data[24:HEAD] + text + data[HEAD + size :])


@pytest.fixture(scope="session")
def model(made_up):
    return PortableModel(made_up.data)


@pytest.fixture(scope="session")
def touched(made_up):
    """The same with places to touch."""
    return PortableModel(made_up.touched)


@pytest.fixture(scope="session")
def asked():
    """60 touches, (place, depth [m], direction or None): straight and tilted, some too deep or too far aslant."""
    rng, found = np.random.default_rng(8), []
    for k in range(60):
        way = None if k % 3 == 0 else [*rng.normal(0.0, 0.5, 2).tolist(), -1.0]
        found.append((k % 2, float(0.007 * rng.random()) * (k > 1), way))
    return found


@pytest.fixture(scope="session")
def pressed(slab_case):
    """The slab under a disc, and a force that moves it by about 5 % of its size."""
    case, test, _ = slab_case
    return replace(case, radius_m=0.03), 0.4 * float(np.linalg.norm(test.force[0]))


@pytest.fixture(scope="session")
def exported(pressed, tmp_path_factory):
    """The slab's contact modes, read from a file in folders that had to be made."""
    path = tmp_path_factory.mktemp("exported") / "to/here/slab.palpate"
    export_model(pressed[0], MODEL, 4, path)
    return read(path)


@pytest.fixture(scope="session")
def loads(model):
    """36 loads, a list of presses each: one or two presses, by force or to a depth, gentle and too hard."""
    rng, found = np.random.default_rng(5), []
    for k in range(36):
        presses = []
        for _ in range(1 + (k % 5 == 0)):
            press = {"triangle": int(rng.integers(len(model.triangles))), "weights": rng.dirichlet([1, 1, 1]).tolist()}
            given = 10.0 ** rng.uniform(-4, -0.2) * rng.normal(size=3)
            press |= {"moved": (0.01 * given).tolist()} if k % 3 == 2 else {"force": given.tolist()}
            presses.append(press)
        found.append(presses)
    return found


@pytest.fixture(scope="session")
def pairs(model):
    """24 pairs of discs on the top, pushed in alike or one twice as deep as the other, from 0 to 2 radii apart."""
    rng, found = np.random.default_rng(6), []
    for k in range(24):
        first, turn = np.array([*rng.uniform(0.03, 0.07, 2), 0.1]), rng.uniform(0.0, 2.0 * np.pi)
        apart = model.radius_m * (0.0, 0.25, 0.5, 1.0, 2.0, 0.05)[k % 6]
        second = np.clip(first + apart * np.array([np.cos(turn), np.sin(turn), 0.0]), 0.0, 0.1)
        depth = 10.0 ** rng.uniform(-5, -3)
        deeper = depth * (1 + k // 12)
        found.append([press_near(model, first, depth), press_near(model, second, deeper)])
    return found


@pytest.fixture(scope="session")
def drags(loads):
    """Each load after one that begins its way: at a place beside it, with nine tenths of the force or the depth."""

    def before(press):
        given = "moved" if "moved" in press else "force"
        weights = (0.9 * np.array(press["weights"]) + 0.1 / 3.0).tolist()
        return press | {"weights": weights, given: [0.9 * each for each in press[given]]}

    return [([before(press) for press in presses], presses) for presses in loads]


@pytest.fixture(scope="session")
def cold(model, loads):
    """The answers of the Python runtime."""
    return [model.respond(presses) for presses in loads]


@pytest.fixture(scope="session")
def warm(model, drags):
    """The same answers, each found from an earlier one."""
    return [model.respond(presses, start=model.respond(before)) for before, presses in drags]


def press_near(model, point, depth):
    """Return a press straight into the flat face that ``point`` lies on."""
    corners = model.nodes[model.triangles]
    first, edges = corners[:, 0], corners[:, 1:] - corners[:, :1]
    shares = np.einsum("tij,ti->tj", np.linalg.pinv(edges), point - first)
    weights = np.clip(np.column_stack([1.0 - shares.sum(axis=1), shares]), 0.0, 1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    at = int(np.argmin(np.linalg.norm(np.einsum("ti,tij->tj", weights, corners) - point, axis=1)))
    moved = (-depth * model._facing[at]).tolist()
    return {"triangle": at, "weights": weights[at].tolist(), "moved": moved}


@pytest.fixture(scope="session")
def compiled(tmp_path_factory):
    """A function that compiles a program, by its name in this folder or its path, with sanitizers or for speed."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("there is no C compiler")
    folder = tmp_path_factory.mktemp("c")

    @cache
    def build(name, checks=True):
        source = HERE / f"{name}.c" if isinstance(name, str) else name
        program = folder / f"{source.stem}{checks}"
        flags = [*FLAGS, *(CHECKS if checks else ["-O2"]), f"-I{RUNTIMES}"]
        sources = [str(source), str(RUNTIMES / "palpate.c")]
        done = subprocess.run([compiler, *flags, *sources, "-o", str(program), "-lm"], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return program

    return build


@pytest.fixture(scope="session")
def node():
    """A function that runs a script with the JavaScript runtime and some files, and returns what it prints."""
    if shutil.which("node") is None:
        pytest.skip("there is no node")

    def run(script, *files):
        command = ["node", "-e", script, str(RUNTIMES / "palpate.js"), *map(str, files)]
        return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout

    return run
