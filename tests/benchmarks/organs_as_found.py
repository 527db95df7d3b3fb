"""Twelve organs as they are found: each as a body, or one sentence.

    python tests/benchmarks/organs_as_found.py [NAME ...]

Prints, for each file, its triangles, the coarse body's surface nodes, the smallest dihedral angle on any level, and on
the fine level the volume and the greatest distance between the surfaces, either way, against the shape without faults.
"""

import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "src"), str(ROOT / "tests")]

from fixtures.organs import (  # noqa: E402
    organ,
    torn,
    volume,
    write_ascii_stl,
    write_binary_ply,
    write_binary_stl,
    write_blender_obj,
)

from palpate.bodies.make_body import make_body  # noqa: E402
from palpate.bodies.mesh_file import load_shape  # noqa: E402
from palpate.bodies.mesh_quality import quality  # noqa: E402
from palpate.bodies.surfaces.solid import distances, sample  # noqa: E402
from palpate.errors import InputError  # noqa: E402

# file, shape, triangles, units a metre, faults, writer
FILES = [
    ("liver_mm.obj", "liver", 20_000, 1000, True, write_blender_obj),
    ("liver_m.stl", "liver", 2_000, 1, False, write_ascii_stl),
    ("kidney_mm.stl", "kidney", 6_000, 1000, False, write_binary_stl),
    ("spleen_mm.ply", "spleen", 50_000, 1000, True, write_binary_ply),
    ("lobed_cm.obj", "lobed", 20_000, 100, False, write_blender_obj),
    ("stomach_mm.stl", "stomach", 10_000, 1000, True, write_binary_stl),
    ("stomach_wall_mm.ply", "stomach_wall", 20_000, 1000, False, write_binary_ply),
    ("hollow_m.stl", "hollow", 4_000, 1, False, write_binary_stl),
    ("femur_mm.obj", "femur", 20_000, 1000, True, write_blender_obj),
    ("gallbladder_mm.stl", "gallbladder", 50_000, 1000, False, write_binary_stl),
]
SHARED = [("liver.msh", 0.03), ("cylinder.msh", 0.2)]
ENTRY = {"kind": "file", "refinements": 2, "young_pa": 3000, "poisson": 0.3, "density_kg_m3": 1000}


def measure(path, truth, scale_m=None):
    """Print a line about the body from a file, or the sentence that refuses it, and what was warned of."""
    start = time.perf_counter()
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            body = make_body(path.stem, ENTRY | {"path": str(path), "scale_m": scale_m})
        except InputError as error:
            print(f"{path.name}: {error}")
            return
    seconds = time.perf_counter() - start
    points, triangles = truth
    size = np.ptp(points, axis=0).max()
    fine = body.fine
    away = max(
        distances(sample(points, triangles, size / 200)[0], fine.nodes, fine.triangles).max(),
        distances(sample(fine.nodes, fine.triangles, size / 200)[0], points, triangles).max(),
    )
    least = min(quality(mesh)["min_dihedral_deg"] for mesh in body.levels)
    print(
        f"{path.name:20} {len(triangles):6} triangles {len(body.coarse.surface):4} nodes {least:5.1f}° "
        f"volume {100 * (fine.volumes.sum() / volume(points, triangles) - 1):+5.2f} % away {100 * away / size:5.2f} % "
        f"{seconds:5.1f} s"
    )
    for warning in said:
        print("    warning:", str(warning.message).replace(str(path), path.name))


if __name__ == "__main__":
    asked = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        for name, shape, count, units, faults, write in FILES:
            if not asked or name in asked:
                truth = organ(shape, count)
                points, triangles = torn(*truth) if faults else truth
                write(Path(folder) / name, units * points, triangles)
                measure(Path(folder) / name, truth)
    for name, scale_m in SHARED:
        path = ROOT.parent / "shared" / "meshes" / name
        if path.exists() and (not asked or name in asked):
            points, triangles, _ = load_shape(path)
            measure(path, (scale_m * points, triangles), scale_m)
