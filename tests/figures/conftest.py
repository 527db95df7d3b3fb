"""One small body with a made-up database, predictions and tables, for drawing."""

import shutil
from types import SimpleNamespace

import h5py
import numpy as np
import pandas as pd
import pytest
from skfem import MeshTet

from palpate.bodies.body import Material, nest
from palpate.bodies.mesh import TetMesh
from palpate.enrichment.database import Database
from palpate.figures import style, tables
from palpate.scenes.motion import Motion

METHODS = [m for m in style.METHODS if m not in ("live_all_in", "coarse_fem", "fine_fem")]


@pytest.fixture(scope="session")
def body():
    """A beam of 0.2 m × 0.05 m × 0.05 m, held at one end."""
    box = MeshTet.init_tensor(np.linspace(0, 0.2, 5), np.linspace(0, 0.05, 2), np.linspace(0, 0.05, 2))
    nodes, elements = box.p.T.copy(), box.t.T.astype(np.int64)
    inverted = TetMesh(nodes, elements).volumes < 0
    elements[inverted] = elements[inverted][:, [0, 2, 1, 3]]
    mesh = TetMesh(nodes, elements)
    return nest("beam", mesh, 1, np.flatnonzero(nodes[:, 0] == 0), Material(3000, 0.3, 1000))


@pytest.fixture(scope="session")
def database(body):
    """Eight samples: two magnitudes at four contacts, bending like x²."""
    coarse, fine = body.coarse, body.fine
    surface = fine.surface
    renumber = np.full(len(fine.nodes), -1)
    renumber[surface] = np.arange(len(surface))
    contact = np.repeat(np.setdiff1d(coarse.surface, body.anchors[0])[[1, 4, 7, 10]], 2)
    force = -coarse.normals[contact] * np.tile([0.5, 1.0], 4)[:, None]

    def bend(nodes):
        return 0.5 * (nodes[:, :1] ** 2)[None] * force[:, None, :]

    return Database(
        nodes_fine_surface=fine.nodes[surface],
        triangles=renumber[fine.triangles],
        coarse_nodes=coarse.nodes,
        coarse_tetrahedra=coarse.tetrahedra,
        coarse_surface=coarse.surface,
        prolongation=body.prolongation[surface],
        contact_normals=coarse.normals[coarse.surface],
        contact=contact,
        force=force,
        fine=bend(fine.nodes[surface]),
        coarse_paper=bend(coarse.nodes),
        coarse_live=0.8 * bend(coarse.nodes),
        residual=np.full(8, 1e-10),
        material=body.material,
        config_digest="none",
    )


@pytest.fixture(scope="session")
def predictions_file(database, tmp_path_factory):
    """Each method is wrong by its own share of the fine response, the more the later the sample."""
    path = tmp_path_factory.mktemp("predictions") / "predictions.h5"
    sample = np.array([0, 3, 4, 5, 7])
    shares = {"interpolation": 0.05, style.BASELINE: 0.1, style.PAPERS: 0.3, "ours": 0.01}
    with h5py.File(path, "w") as file:
        for method, share in shares.items():
            wrong = 1 + share * (1 + sample / 10)
            group = file.create_group(f"paper/samples/{method}")
            group["sample"], group["predicted"] = sample, database.fine[sample] * wrong[:, None, None]
    return path


@pytest.fixture(scope="session")
def results():
    """All tables for one body of the paper's and one of somebody else's."""
    cases = [
        (b, r, p, s)
        for b in ("liver", "own")
        for r in ("small", "large")
        for p in ("paper", "live")
        for s in ("samples", "contacts")
    ]
    accuracy, sweep = [], []
    for case in cases:
        for i, method in enumerate(METHODS):
            failed = method == "pod_rbf" and case[0] == "own"
            error = np.nan if failed else 0.4 / (i + 1)
            sigma = 0.01 if method.endswith(tuple(style.WEIGHTS)) else np.nan
            accuracy.append([*case, method, sigma, 45, error * 0.004, error, 2 * error, 3 * error])
        for features in style.FEATURES:
            for weights in style.WEIGHTS:
                for relative in np.geomspace(0.01, 100, 5):
                    error = 0.1 + 0.01 * np.log10(relative) ** 2
                    sweep.append([*case, features, weights, 0.01 * relative, relative, error * 0.004, error])
    cost = [
        [b, m, p, 1e-4 * (i + 1), 2e-4 * (i + 1)]
        for b in ("liver", "own")
        for p in ("paper", "live")
        for i, m in enumerate(METHODS)
    ]
    timing = [
        [b, m, *[t] * 6, theirs if b == "liver" else np.nan]
        for b in ("liver", "own")
        for m, t, theirs in (
            ("fine_fem", 0.5, 49.292),
            ("unordered", 2e-4, 0.603),
            ("contact_ordered", 1e-4, 0.128),
            ("ours", 1e-3, np.nan),
            ("live_all_in", 3e-3, np.nan),
        )
    ]
    samples = [(b, r, i) for b in ("liver", "own") for r in ("small", "large") for i in range(4)]
    values = {
        "mesh_sizes": [
            ["liver", 0, 140, 276, 181, 596, 140, 276],
            ["own", 0, 20, 36, 30, 60, np.nan, np.nan],
        ],
        "splits": [
            [b, r, s, 60, 45] for b in ("liver", "own") for r in ("small", "large") for s in ("samples", "contacts")
        ],
        "sigma_sweep": sweep,
        "enrichment_accuracy": accuracy,
        "enrichment_timing": timing,
        "online_cost": cost,
        "complexity": [["building_w", "O(r k)", 0.9, 0.8, 1.0, 1.0, 1.05, 1.0, 1.1, 1.0]],
        "fem_cost": [[*s, 5 + s[2], 60, 1e-9, 0.5 + s[2]] for s in samples],
        "claims": [["building w costs O(r k)", "O(r k)", "r^0.90, k^1.05", "confirmed"]],
        "sample_peaks": [[*s, 0.004 + 0.001 * s[2]] for s in samples],
    }
    return {n: pd.DataFrame(rows, columns=tables.COLUMNS[n].split()) for n, rows in values.items()}


SCENES = ["press", "sag"]


@pytest.fixture(scope="session")
def sagging(body):
    """The beam bending down (-y) as x² and back to where it began within 1 s, 31 frames, and its energies."""
    mesh, times = body.coarse, np.linspace(0, 1, 31)
    down = 0.5 * np.sin(np.pi * times)[:, None] ** 2 * mesh.nodes[:, 0] ** 2 / 0.2
    positions = np.repeat(mesh.nodes[None], len(times), axis=0)
    positions[:, :, 1] -= down
    energy = pd.DataFrame({"time_s": times, "kinetic_j": 0.0, "outer_work_j": 0.0, "total_j": 0.0})
    cells = mesh.triangles, mesh.tetrahedra
    return Motion("sag", times, positions, positions[0], *cells, body.anchors[0], energy, up=1)


@pytest.fixture(scope="session")
def scene_results():
    """The tables of a scene that is pushed and one that sags: 2 mJ go in, and damping takes some."""
    t = np.linspace(0, 1, 11)
    pushed = pd.DataFrame(
        {"scene": "press", "time_s": t, "kinetic_j": 0.0, "springs_j": 1.5e-3 * t, "outer_work_j": 2e-3 * t}
    )
    pushed["total_j"] = pushed["springs_j"]
    sagged = pd.DataFrame(
        {"scene": "sag", "time_s": t, "kinetic_j": 1e-3 * t * (1 - t), "gravity_j": 5 - 2e-3 * t, "outer_work_j": 0.0}
    )
    sagged["corotational_j"] = 1e-3 * t**2
    sagged["total_j"] = sagged[["kinetic_j", "gravity_j", "corotational_j"]].sum(axis=1)
    costs = [
        ["press", "springs", 0.75, 0.75, 8.0, np.nan, "it holds the body together"],
        ["press", "push", 0.05, 0.05, 1.0, 1.0, np.nan],
        ["press", "kelvin", 0.2, 0.2, 4.0, 2e-7, np.nan],
        ["sag", "corotational", 3.0, 0.6, 80.0, np.nan, "it holds the body together"],
        ["sag", "gravity", 0.0, 0.0, 1.0, 1.0, np.nan],
        ["sag", "held", 0.0, 0.0, 1.0, 40.0, np.nan],
        ["sag", "integrator", 2.0, 0.4, np.nan, np.nan, np.nan],
    ]
    decisions = [
        ["press", "springs", True, "the scene describes it"],
        ["press", "gravity", False, "no acceleration is given"],
        ["sag", "corotational", True, "the body is made of tetrahedra"],
        ["sag", "gravity", True, "9.81 m/s² act on 0.5 kg"],
    ]
    return {
        "scene_effects": pd.DataFrame(decisions, columns=tables.COLUMNS["scene_effects"].split()),
        "effects": pd.DataFrame(costs, columns=[*tables.COLUMNS["effects"].split(), "note"]),
        "energy": pd.concat([pushed, sagged]),
    }


@pytest.fixture(scope="session")
def soft_body_results():
    """The tables of paper 3's experiments."""
    rows = {
        "shape_matching_timing": [
            [100, clusters, "quadratic", objects, 100 * objects, 200 * objects, 0.002 * clusters * objects, 1]
            for clusters in (1, 8)
            for objects in (1, 30, 100, 1000)
        ],
        "integrator_stability": [
            ["symplectic_euler", np.nan, 1.0, 1.0, 1.0, 2.0, 2.001],
            ["symplectic_euler", np.nan, 4.0, 13.9, 13.9 * 1.002, 2.0, 2.001],
            ["goal_position", 0.5, 4.0, 1.0, 1.001, np.inf, np.inf],
        ],
        "clusters": [
            [count, 0.15, particle, 0.0, 0.0, z, bent * z, 0.0, z]
            for count, bent in ((1, 0.1), (2, 0.3))
            for particle, z in enumerate((0.0, 0.1, 0.28))
        ],
        "body_springs": [
            [
                case,
                stiffness,
                time,
                phase,
                0.01 * ring,
                u / 2 / (1 + ring),
                u / (1 + ring),
                10,
                10 if ring < moved else 1,
            ]
            for case, stiffness, moved, left in (("none", 0.0, 3, 0.004), ("body_springs", 10.0, 1, 0.0))
            for time, phase, u in ((0.5, "hold", 0.01), (1.0, "hold", 0.02), (3.0, "after", left))
            for ring in range(3)
        ],
    }
    return {name: pd.DataFrame(values, columns=tables.COLUMNS[name].split()) for name, values in rows.items()}


@pytest.fixture(scope="session")
def ct_results():
    """The tables of one body from CT, weighed at two resolutions."""
    rows = {
        "node_mass": [
            ["abdomen", 600, 180, 1.15, 1065.0, 0.02, -0.09],
            ["abdomen", 9000, 2000, 1.13, 1072.0, 0.001, -0.01],
        ],
        "mesh_quality": [["abdomen", 0, 12.5, 140.0, 0.3, 1.07e-3], ["abdomen", 1, 9.5, 150.0, 0.2, 1.07e-3]],
    }
    return {name: pd.DataFrame(values, columns=tables.COLUMNS[name].split()) for name, values in rows.items()}


@pytest.fixture(scope="session")
def spring_results():
    """The tables of paper 2: the gradient passes the genetic algorithm's end after 2 of its 10 s."""
    ends = {"uniform": 0.2, "van_gelder": 0.3, "lloyd": 0.25, "genetic": 0.06, "cma_es": 0.05, "gradient": 0.03}
    fits, history, errors = [], [], []
    for force in (False, True):
        for method, best in (ends | {"gradient_smooth": 0.045, "gradient_all": 0.04}).items():
            for seed in (1, 2, 3) if method in ("genetic", "cma_es") else (1,):
                way, end = (method, force, seed), best * (1 + 0.1 * (seed - 1))
                count = {"genetic": 20, "cma_es": 10}.get(method, 10 if method.startswith("gradient") else 0)
                for i in range(count + 1):
                    left = 0.5 * (1 - i / count) if count else 0.0
                    history.append([*way, i, 30 * (i + 1), 1.0 + i, -end - left])
                for press in ("top", "left", "front"):
                    used = press == "top" or method == "gradient_all"
                    error = end if used else 3 * end
                    fits.append([*way, press, used, 4e-4 * error, error, *[1e-3 * error] * 3, -error, count, 600, 10.0])
                    errors += [[*way, press, used, step, *[1e-5 * step * error] * 3] for step in range(1, 6)]
    floor = [
        [poisson, force, 0.1 * force, press, 4e-5 * (1 + poisson), (0.1 - 0.04 * force) * (1 + poisson)]
        for poisson in (0.1, 0.25, 0.49)
        for force in (False, True)
        for press in ("top", "left", "front")
    ]
    rows = {"spring_fit": fits, "spring_history": history, "spring_errors": errors, "spring_floor": floor}
    return {name: pd.DataFrame(values, columns=tables.COLUMNS[name].split()) for name, values in rows.items()}


@pytest.fixture(scope="session")
def collision_results():
    """The tables of chapter 4 of paper 3: each structure is as fast and as loose as its number says, a rival 20 ms."""
    costs = {("sphere", None): 4.0, ("aabb", None): 1.0, ("composite", "4/2"): 2.0, ("composite", "8/4"): 4.0}
    rows, growth = [], []
    for scene, rivals in (("two_livers", True), ("folding_sheet", False)):
        for (structure, depths), cost in costs.items():
            false = 100 * (cost if structure == "sphere" or depths == "8/4" else 1.0)
            tests = [1e4 * cost, 50 + false, 50.0]
            rows.append([scene, structure, depths, False, 8832, 2, 0.5, cost, 0.5 + cost, *tests, 0, 0, 1, 200, 1])
        if rivals:
            tests = [np.nan, np.nan, 49.0]
            rows.append([scene, "obb_coal", None, True, 8832, 10.0, np.nan, 2.0, 12.0, *tests, 7, 3, 0, 50, 1])
    for structure, depths in costs:
        for n in (1000, 10_000, 1_000_000):
            growth.append([structure, depths, False, n, 1e-3 * n, 1e-4 * n, 1e-2 * n**0.5, n**0.5, 1])
    for n in (1000, 10_000, 1_000_000):
        growth.append(["obb_coal", None, True, n, 1e-2 * n, np.nan, 1e-1 * n**0.5, n**0.5, 1])
    claims = [["query time (composite 4/2, all scenes)", "between sphere and AABB", "4, 2, 1", "confirmed"]]
    values = {"collision": rows, "collision_scaling": growth, "collision_claims": claims}
    return {name: pd.DataFrame(found, columns=tables.COLUMNS[name].split()) for name, found in values.items()}


@pytest.fixture(scope="session")
def whole_folder(
    results, scene_results, soft_body_results, ct_results, spring_results, collision_results, tmp_path_factory
):
    """The tables as CSV, and a placeholder for every figure the report asks for."""
    folder = tmp_path_factory.mktemp("results")
    figures = folder / "figures"
    figures.mkdir()
    (folder / "tables").mkdir()
    every = results | scene_results | soft_body_results | ct_results | spring_results | collision_results
    for name, table in every.items():
        table.to_csv(folder / "tables" / f"{name}.csv", index=False)
    names = ["mesh_levels", "sigma_sweep", "complexity", "timing_bars", "accuracy_vs_time", "fem_cost"]
    for body in ("liver", "own"):
        for regime in ("small", "large"):
            names += [f"deformed_{body}_{regime}", f"error_over_body_{body}_{regime}"]
    by_part = {
        "ct": ["node_mass", "ct_slices_abdomen", "ct_volume_abdomen"],
        "scenes": ["energy", "effects", *(f"motion_{scene}" for scene in SCENES)],
        "soft_bodies": list(soft_body_results),
        "springs": ["spring_fit", "spring_errors", "spring_floor"],
        "collision": ["collision", "collision_scaling"],
        "enrichment": names,
    }
    for name in (name for part in by_part.values() for name in part):
        (figures / f"{name}.svg").write_text(f"<svg><!-- {name} --></svg>")
        (figures / f"{name}.png").write_bytes(b"png")
    for name in [name for part in by_part.values() for name in part if name.startswith(("motion", "error_over_body"))]:
        (figures / f"{name}.json").write_text(f'{{"name": "{name}"}}')
    return SimpleNamespace(path=folder, figures=by_part, scenes=SCENES, cts=["abdomen"])


@pytest.fixture
def results_folder(whole_folder, tmp_path):
    """A copy of the same, to be damaged."""
    shutil.copytree(whole_folder.path, tmp_path, dirs_exist_ok=True)
    return SimpleNamespace(**vars(whole_folder) | {"path": tmp_path})
