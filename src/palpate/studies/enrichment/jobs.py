"""Fit and test all methods on paper 1's samples, sweep the width σ of their kernels, and draw what they predict.

The paper picks its σ from that table of errors, which is on the test samples. The methods' own σ comes from
cross-validation on the training samples and stands in enrichment_accuracy.csv, so both can be compared.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd

from palpate.benchmark.database import SPLITS, Database, read
from palpate.benchmark.settings import FitOptions, Regression
from palpate.bodies.body_file import load
from palpate.models.enrichment.features import FEATURES, describe
from palpate.models.enrichment.paper_enrichment import WEIGHTS, BlendWeights, DescribedSamples, squared_distances
from palpate.models.enrichment.training_samples import blend_errors, gather
from palpate.run.job import stem
from palpate.stores import stored
from palpate.studies.enrichment.samples import accuracy_rows, predict, read_samples, sides
from palpate.table_declaration import Table


def sweep_sigma(
    input,
    output,
    wildcards,
    cases: list[tuple[str, Literal["samples", "contacts"]]],
    shown: list[str],
    regression: Regression,
    seed: int,
):
    """Fit and test methods, and sweep their σ, in ``cases`` (protocol, split); write what those ``shown`` predict."""
    import h5py

    from palpate.files import write_whole
    from palpate.models.enrichment.methods import build
    from palpate.solvers.compliance import Compliance

    db, compliance, samples = read(input.database), stored(Compliance, input.compliance), read_samples(input.samples)
    labels, sweeps, tables = dict(wildcards.items()), [], []
    with write_whole(output.predictions) as path, h5py.File(path, "w") as file:
        for protocol, split in cases:
            options = FitOptions(**dict(regression), split=split, seed=seed)
            train, test = sides(samples, split)
            sweeps.append(sweep_rows(db, train, test, protocol, options, labels))
            methods = build(gather(db.take(train), protocol, options, compliance))
            tables.append(accuracy_rows(db, methods, protocol, test, {**labels, "split": split}))
            for name in shown:
                file[f"{protocol}/{split}/{name}/sample"] = test
                file[f"{protocol}/{split}/{name}/predicted"] = predict(db, methods[name], protocol, test)
    return {"sweep": pd.concat(sweeps), "accuracy": pd.concat(tables)}


SPLIT_COUNTS = Table(
    "splits",
    "How many samples of each body and regime the methods learn from, and how many they are tested on.",
    """
    body regime split train test: a database, what is held out, and numbers of samples
    """,
)

SAMPLE_PEAKS = Table(
    "sample_peaks",
    "The largest displacement of the surface in each sample.",
    """
    body regime sample peak_m: a sample, and its largest displacement [m]
    """,
)

FEM_COST = Table(
    "fem_cost",
    "The work, the time and the last residual of each finite-element simulation on the fine mesh.",
    """
    body regime sample: a sample
    newton_iterations linear_solves residual seconds: iterations, solves, last relative residual, and time [s]
    """,
)


def tabulate_enrichment(input, output):
    """Put the tables of all bodies together, and draw their meshes, for the rule of this name."""
    from palpate.benchmark.static_responses import Responses
    from palpate.files import merge
    from palpate.report import mesh_levels, style

    merge(input, output)
    style.save(mesh_levels.draw_mesh_levels([load(path) for path in input.bodies]), stem(output.meshes))
    samples = pd.concat(_labelled(read_samples(path), path) for path in input.samples)
    costs = pd.concat(_labelled(stored(Responses, path).costs(), path) for path in map(Path, input.fine))
    split_rows = [
        [*names, split, *((rows[split] == side).sum() for side in ("train", "test"))]
        for names, rows in samples.groupby(["body", "regime"], sort=False)
        for split in SPLITS
    ]
    return {
        "sample_peaks": samples[SAMPLE_PEAKS.columns],
        "splits": SPLIT_COUNTS.frame(split_rows),
        "fem_cost": costs[FEM_COST.columns],
    }


def _labelled(table: pd.DataFrame, path: str | Path) -> pd.DataFrame:
    """Return a ``table`` with the columns body and regime, the folders that the file ``path`` lies in."""
    body, regime = Path(path).parts[-3:-1]
    return table.assign(body=body, regime=regime)


def draw_responses(input, output):
    """Draw what methods predict of one body and regime, and their errors over the body, for the rule of this name."""
    from palpate.report import style
    from palpate.studies.enrichment.figures import bodies

    body, db, path = load(input.body), read(input.database), input.predictions
    shown = bodies.read(path, "paper", "samples", bodies.DEFORMED_BY)
    style.save(bodies.draw_deformed_bodies(body, db, shown), stem(output.deformed))
    groups = {
        f"{protocol} protocol, {split} held out": bodies.read(path, protocol, split, bodies.JUDGED)
        for protocol, split in (("paper", "samples"), ("live", "contacts"))
    }
    style.save(bodies.draw_error_over_body(body, db, groups), stem(output.errors))
    bodies.write(db, groups["live protocol, contacts held out"], output.turnable)


SIGMA_SWEEP = Table(
    "sigma_sweep",
    "The test error of each blend at every width σ of its Gaussian kernel.",
    """
    body regime protocol split: a database, and what the coarse nodes come from and what is held out
    features weights: of the blend
    sigma_m sigma_relative: width [m], and over the features' distance
    rmse_m rmse_of_peak: mean error of the test samples [m], and over their peaks
    """,
)


def sweep_rows(
    db: Database, train: np.ndarray, test: np.ndarray, protocol: str, options: FitOptions, labels: Mapping[str, str]
) -> pd.DataFrame:
    """Tabulate sigma_sweep.csv of one database: the mean test error of each blend at each width of its kernel."""
    training = gather(db.take(train), protocol, options)
    rows = []
    for features in FEATURES:
        described = DescribedSamples(training, features)
        test_features, slots = describe(described.features, db.contact[test], db.coarse(protocol)[test], db.fine[test])
        distances = squared_distances(described.described, test_features)
        among, across, squares = described.slots @ described.slots.T, described.slots @ slots.T, (slots**2).sum(axis=1)
        for weights in WEIGHTS:
            for sigma in described.sigmas:
                blend_weights = BlendWeights(weights, described.squared, sigma)(distances)
                rmse = np.sqrt(blend_errors(blend_weights, among, across, squares) / db.fine.shape[1])
                case = [labels["body"], labels["regime"], protocol, options.split, features, weights]
                rows.append([*case, sigma, sigma / described.scale, rmse.mean(), (rmse / db.peaks[test]).mean()])
    return SIGMA_SWEEP.frame(rows)
