"""One small body with a made-up database, predictions and tables, for drawing."""

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


@pytest.fixture
def results_folder(results, tmp_path):
    """The tables as CSV, and a placeholder for every figure the report asks for."""
    figures = tmp_path / "figures"
    figures.mkdir()
    (tmp_path / "tables").mkdir()
    for name, table in results.items():
        table.to_csv(tmp_path / "tables" / f"{name}.csv", index=False)
    names = ["mesh_levels", "sigma_sweep", "complexity", "timing_bars", "accuracy_vs_time", "fem_cost"]
    for body in ("liver", "own"):
        for regime in ("small", "large"):
            names += [f"deformed_{body}_{regime}", f"error_over_body_{body}_{regime}"]
    for name in names:
        (figures / f"{name}.svg").write_text(f"<svg><!-- {name} --></svg>")
        (figures / f"{name}.png").write_bytes(b"png")
    return SimpleNamespace(path=tmp_path, figures=names)
