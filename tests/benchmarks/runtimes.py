"""Time an answer of a portable model in Python, C and JavaScript, side by side.

    python tests/benchmarks/runtimes.py FILE [LOADS]

LOADS (default 60) presses, half as hard as contacts bear, at places drawn at random; every second one is pushed to a
depth. Prints median times [ms] of the processor and the largest distance from Python's answer over its peak.
"""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from time import process_time

import numpy as np

import palpate.portable.runtimes
from palpate.portable.file import PortableModel, read

RUNTIMES = Path(palpate.portable.runtimes.__file__).parent
PROGRAM = Path(__file__).parents[1] / "portable/ask.c"
ASK = """
const Palpate = require(process.argv[1]), fs = require("fs"), whole = fs.readFileSync(process.argv[2]);
const model = Palpate.load(whole.buffer.slice(whole.byteOffset, whole.byteOffset + whole.length));
const loads = JSON.parse(fs.readFileSync(process.argv[3]));
for (let k = 0; k < 3; k++) for (const load of loads) model.respond(load);
const found = loads.map((load) => {
  const begin = process.cpuUsage(), displacement = Array.from(model.respond(load).displacement);
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
        begin = process_time()
        answers.append(model.respond(load).displacement)
        times.append(1e3 * (process_time() - begin))
    print("runtime,force_ms,depth_ms,apart_of_peak")
    show("python", times, answers, answers)
    with tempfile.TemporaryDirectory() as folder:
        if compiler := shutil.which("cc") or shutil.which("gcc"):
            show("c", *in_c(compiler, path, loads, Path(folder), len(model.nodes)), answers)
        if shutil.which("node"):
            show("javascript", *in_javascript(path, loads, Path(folder)), answers)


def draw(model: PortableModel, count: int) -> list[list[dict]]:
    """Draw presses near contacts."""
    rng, loads = np.random.default_rng(0), []
    for k in range(count):
        contact = model.contacts[rng.integers(len(model.contacts))]
        near = np.flatnonzero(np.linalg.norm(model._middles - contact.place, axis=1) < model.radius_m)
        force = 0.5 * contact.bearing / (contact.bearing @ contact.bearing)
        press = {
            "triangle": int(rng.choice(near)),
            "weights": rng.dirichlet([1, 1, 1]).tolist(),
            "force": force.tolist(),
        }
        if k % 2:
            place = model._place(press)
            linear, bent = model._parts_of([place], force[None])
            press = {name: press[name] for name in ("triangle", "weights")}
            press["moved"] = (place.disc @ (linear + bent[0].more)).tolist()
        loads.append([press])
    return loads


def show(name: str, times: list[float], answers: list[np.ndarray], right: list[np.ndarray]) -> None:
    """Print a row."""
    apart = max(np.abs(a - b).max() / np.linalg.norm(b, axis=1).max() for a, b in zip(answers, right, strict=True))
    print(f"{name},{np.median(times[::2]):.2f},{np.median(times[1::2]):.2f},{apart:.1e}", flush=True)


def in_c(compiler: str, path: Path, loads: list, folder: Path, n: int) -> tuple[list[float], list[np.ndarray]]:
    """Return times [ms] and displacements [(n, 3)] of the C runtime."""
    rows: list[float] = []
    for (press,) in loads:
        moves = "moved" in press
        rows += [1, press["triangle"], *press["weights"], float(moves), *press["moved" if moves else "force"]]
    np.array(rows, dtype=float).tofile(folder / "loads")
    sources = [str(PROGRAM), str(RUNTIMES / "palpate.c"), f"-I{RUNTIMES}"]
    fast = ["-std=c99", "-O3", "-march=native"]
    subprocess.run([compiler, *fast, *sources, "-o", str(folder / "ask"), "-lm"], check=True)
    subprocess.run([folder / "ask", path, folder / "loads", folder / "answers"], check=True)
    data, size, times, answers = (folder / "answers").read_bytes(), 48 + 12 * n + 160, [], []
    for at in range(0, len(data), size):
        times.append(float(np.frombuffer(data, float, 3, at)[2]))
        answers.append(np.frombuffer(data, np.float32, 3 * n, at + 48).reshape(n, 3))
    return times, answers


def in_javascript(path: Path, loads: list, folder: Path) -> tuple[list[float], list[np.ndarray]]:
    """Return times [ms] and displacements [(n, 3)] of the JavaScript runtime."""
    (folder / "loads.json").write_text(json.dumps(loads))
    files = [str(RUNTIMES / "palpate.js"), str(path), str(folder / "loads.json"), str(folder / "out.json")]
    subprocess.run(["node", "-e", ASK, *files], check=True)
    found = json.loads((folder / "out.json").read_text())
    return [each["ms"] for each in found], [np.array(each["displacement"]).reshape(-1, 3) for each in found]


if __name__ == "__main__":
    main()
