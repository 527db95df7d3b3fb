"""Time an answer of a portable model in Python, C and JavaScript, side by side.

    python tests/benchmarks/runtimes.py FILE [LOADS]

LOADS (default 60) presses of each kind, half as hard as contacts bear, at places drawn at random: by a force, pushed
to a depth, two discs pushed to a depth, and one pushed to a depth that starts from the answer to a press beside it, as
in a drag; none that is doubted. Prints median times [ms] of the processor and the largest distance from Python's
answer over its peak.
"""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from time import process_time

import numpy as np

import palpate.press.portable.runtimes
from palpate.press.portable.file import PortableModel, read
from palpate.press.portable.runtimes.palpate_model import undeformed

RUNTIMES = Path(palpate.press.portable.runtimes.__file__).parent
PROGRAM = Path(__file__).parents[1] / "press/portable/ask.c"
KINDS = ("force", "depth", "two", "drag")
ASK = """
const Palpate = require(process.argv[1]), fs = require("fs"), model = Palpate.load(fs.readFileSync(process.argv[2]));
const loads = JSON.parse(fs.readFileSync(process.argv[3]));
for (let k = 0; k < 3; k++) for (const {presses} of loads) model.respond(presses);
const found = loads.map(({presses, before}) => {
  const from = before ? model.respond(before) : null, begin = process.cpuUsage();
  const displacement = Array.from(model.respond(presses, {from}).displacement);
  return {ms: process.cpuUsage(begin).user / 1e3, displacement};
});
fs.writeFileSync(process.argv[4], JSON.stringify(found));
"""


def main() -> None:
    path, count = Path(sys.argv[1]), int(sys.argv[2]) if sys.argv[2:] else 60
    model = read(path)
    loads = draw(model, count)
    times, answers = [], []
    for load in loads:
        start = model.respond(load["before"]) if "before" in load else None
        begin = process_time()
        answers.append(model.respond(load["presses"], start).displacement)
        times.append(1e3 * (process_time() - begin))
    print("runtime," + ",".join(f"{kind}_ms" for kind in KINDS) + ",apart_of_peak")
    show("python", times, answers, answers)
    with tempfile.TemporaryDirectory() as folder:
        if compiler := shutil.which("cc") or shutil.which("gcc"):
            show("c", *in_c(compiler, path, loads, Path(folder), len(model.nodes)), answers)
        if shutil.which("node"):
            show("javascript", *in_javascript(path, loads, Path(folder)), answers)


def draw(model: PortableModel, count: int) -> list[dict]:
    """Draw presses of all kinds, in turn; what a drag starts from is a tenth of a triangle and of the depth away."""
    rng, loads = np.random.default_rng(0), []
    while len(loads) < 4 * count:
        kind = KINDS[len(loads) % 4]
        press = draw_press(model, rng)
        load = {"presses": [press if kind == "force" else pushed(model, press)]}
        if kind == "two":
            load["presses"].append(pushed(model, draw_press(model, rng)))
        if kind == "drag":
            (press,) = load["presses"]
            weights = (0.9 * np.array(press["weights"]) + 0.1 / 3.0).tolist()
            load["before"] = [press | {"weights": weights, "moved": [0.9 * each for each in press["moved"]]}]
        if not model.respond(load["presses"]).doubt:
            loads.append(load)
    return loads


def draw_press(model: PortableModel, rng: np.random.Generator) -> dict:
    """Draw a press near a contact."""
    contact = model.contacts[rng.integers(len(model.contacts))]
    near = np.flatnonzero(np.linalg.norm(model._middles - contact.place, axis=1) < model.radius_m)
    force = 0.5 * contact.bearing / (contact.bearing @ contact.bearing)
    return {"triangle": int(rng.choice(near)), "weights": rng.dirichlet([1, 1, 1]).tolist(), "force": force.tolist()}


def pushed(model: PortableModel, press: dict) -> dict:
    """Return a press as far as the force of ``press`` moves its disc."""
    place = model._place(press)
    rests = [undeformed(near.contact) for near in place.near]
    linear, bent, _ = model._parts_of([place], np.array([press["force"]]), rests)
    moved = place.disc @ (linear + bent[0].more)
    return {name: press[name] for name in ("triangle", "weights")} | {"moved": moved.tolist()}


def show(name: str, times: list[float], answers: list[np.ndarray], right: list[np.ndarray]) -> None:
    """Print a row."""
    apart = max(np.abs(a - b).max() / np.linalg.norm(b, axis=1).max() for a, b in zip(answers, right, strict=True))
    medians = ",".join(f"{np.median(times[k::4]):.2f}" for k in range(4))
    print(f"{name},{medians},{apart:.1e}", flush=True)


def in_c(compiler: str, path: Path, loads: list[dict], folder: Path, n: int) -> tuple[list[float], list[np.ndarray]]:
    """Return times [ms] and displacements [(n, 3)] of the C runtime."""
    rows: list[float] = []
    for load in loads:
        if "before" in load:
            rows += [1, *as_numbers(load["before"])]
        rows += [(-1 if "before" in load else 1) * len(load["presses"]), *as_numbers(load["presses"])]
    np.array(rows, dtype=float).tofile(folder / "loads")
    sources = [str(PROGRAM), str(RUNTIMES / "palpate.c"), f"-I{RUNTIMES}"]
    fast = ["-std=c99", "-O3", "-march=native"]
    subprocess.run([compiler, *fast, *sources, "-o", str(folder / "ask"), "-lm"], check=True)
    subprocess.run([folder / "ask", path, folder / "loads", folder / "answers"], check=True)
    data, at, times, answers = (folder / "answers").read_bytes(), 0, [], []
    for load in loads:
        at += 48 + 12 * n + 160 if "before" in load else 0
        times.append(float(np.frombuffer(data, float, 3, at)[2]))
        at += 24 + 24 * len(load["presses"])
        answers.append(np.frombuffer(data, np.float32, 3 * n, at).reshape(n, 3))
        at += 12 * n + 160
    return times, answers


def as_numbers(presses: list[dict]) -> list[float]:
    """Return presses as the C program reads them."""
    found: list[float] = []
    for press in presses:
        moves = "moved" in press
        found += [press["triangle"], *press["weights"], float(moves), *press["moved" if moves else "force"]]
    return found


def in_javascript(path: Path, loads: list[dict], folder: Path) -> tuple[list[float], list[np.ndarray]]:
    """Return times [ms] and displacements [(n, 3)] of the JavaScript runtime."""
    (folder / "loads.json").write_text(json.dumps(loads))
    files = [str(RUNTIMES / "palpate.js"), str(path), str(folder / "loads.json"), str(folder / "out.json")]
    subprocess.run(["node", "-e", ASK, *files], check=True)
    found = json.loads((folder / "out.json").read_text())
    return [each["ms"] for each in found], [np.array(each["displacement"]).reshape(-1, 3) for each in found]


if __name__ == "__main__":
    main()
