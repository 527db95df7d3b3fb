"""Compare contact-ordered with unordered features in several premises: errors with intervals, vectors, memory."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import Method
from palpate.benchmark.database import SPLITS, Database, read, split
from palpate.benchmark.ranking import RANGE, resampled
from palpate.benchmark.settings import FitOptions, Regression
from palpate.bodies.settings import Body
from palpate.models.enrichment import paper_enrichment
from palpate.models.enrichment.features import FEATURES, Features, features_of
from palpate.models.enrichment.paper_enrichment import LITERAL, DescribedSamples, gaussian, inverse
from palpate.models.enrichment.training_samples import gather
from palpate.models.interpolation import Interpolation
from palpate.run.job import steps
from palpate.studies.enrichment.premise_samples import prepare, sample_counts
from palpate.studies.enrichment.samples import sample_errors
from palpate.studies.enrichment.settings import Case, Premises
from palpate.table_declaration import Table

READINGS = ("nonnegative_a", "nonnegative_b", LITERAL)
"""Kinds of weights that are compared; the paper's text can be read as each of them."""
PAPERS = READINGS[0]
MOVED = 0.1  # displacement over the peak from which on a node counts as moved


class Zero(Method):
    """The method that predicts zero displacement, whose error the others have to be below."""

    def __init__(self, db: Database):
        self._shape = db.nodes_fine_surface.shape

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        return np.zeros(self._shape)


def split_errors(db: Database, counts: tuple[int, int], number: int, options: FitOptions) -> Iterator[pd.DataFrame]:
    """Yield the errors of every method on the test samples of one split, for each kind of split in SPLITS.

    counts : samples to train on and to hold out; number : of the split, which is added to the seed
    With samples held out, as in the paper, only its own weights are tried.
    """
    for held_out in SPLITS:
        split_options = options.model_copy(update={"split": held_out, "seed": options.seed + number})
        train, test = split(db.contact, *counts, held_out, split_options.seed)
        training = gather(db.take(train), "paper", split_options)
        methods: dict[tuple[str, str], Method] = {
            ("zero", "none"): Zero(db),
            ("interpolation", "none"): Interpolation(db),
        }
        for features in FEATURES:
            readings = READINGS if held_out == "contacts" else (PAPERS,)
            methods |= {(features, weights): paper_enrichment.fit(training, features, weights) for weights in readings}
            if held_out == "contacts":
                methods[features, "linear"] = paper_enrichment.LinearRegressor(training, features)
        yield _errors(db, methods, train, test, number, held_out)


def growing_errors(
    db: Database, counts: tuple[int, int], number: int, options: FitOptions, shares: Sequence[float]
) -> Iterator[pd.DataFrame]:
    """Yield the errors of the paper's weights trained on fractions ``shares`` of the contacts; contacts held out."""
    split_options = options.model_copy(update={"split": "contacts", "seed": options.seed + number})
    train, test = split(db.contact, *counts, "contacts", split_options.seed)
    shuffled_contacts = np.random.default_rng(split_options.seed).permutation(np.unique(db.contact[train]))
    # fewer than two contacts cannot be divided into folds, and split_errors trains on all of them
    for count in sorted({max(2, round(share * len(shuffled_contacts))) for share in shares} - {len(shuffled_contacts)}):
        used_contacts = shuffled_contacts[:count]
        used_samples = train[np.isin(db.contact[train], used_contacts)]
        training = gather(db.take(used_samples), "paper", split_options)
        methods = {(features, PAPERS): paper_enrichment.fit(training, features, PAPERS) for features in FEATURES}
        yield _errors(db, methods, used_samples, test, number, "contacts")


def _errors(db: Database, methods: dict, train: np.ndarray, test: np.ndarray, number: int, kind: str) -> pd.DataFrame:
    """Tabulate the error of each of ``methods``, by features and weights, on each test sample of a split."""
    tables = []
    for (features, weights), method in methods.items():
        table = sample_errors(db, method, "paper", test)[["sample", "rmse_of_peak"]]
        table["contact"] = db.contact[table["sample"]]
        tables.append(table.assign(features=features, weights=weights))
    return pd.concat(tables).assign(split=number, held_out=kind, train=len(train))


PREMISES = Table(
    "premises",
    "The test errors of each kind of feature and weights in each premise, mean of all splits, and their ratio to "
    "those of unordered features.",
    """
    premise held_out train: a premise, what is held out, and the number of training samples
    features weights splits: of the blend, and how many splits were averaged
    rmse_of_peak error_low error_high: error, and an interval that holds 90 % of draws of contacts
    ratio ratio_low ratio_high: error over that of unordered features with the same weights, and its interval
    """,
)


def summarise(errors: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the mean errors of one premise and their ratios to those of unordered features, with intervals.

    errors : with the columns held_out, train, split, features, weights, sample, contact, rmse_of_peak
    Returns the columns of PREMISES after the first.
    """
    rows = []
    for (held_out, train), table in errors.groupby(["held_out", "train"], sort=False):
        draws = resampled(table.rename(columns={"features": "model", "weights": "setting"}), "rmse_of_peak")
        means = table.groupby(["features", "weights"], sort=False)["rmse_of_peak"].mean()
        for (features, weights), mean in means.items():
            drawn_means, baseline, ratio = draws.loc[(features, weights)], ("unordered", weights), [np.nan] * 3
            if baseline in means.index:
                ratio = [mean / means[baseline], *np.quantile(drawn_means / draws.loc[baseline], RANGE)]
            labels = [held_out, train, features, weights, table["split"].nunique()]
            rows.append([*labels, mean, *np.quantile(drawn_means, RANGE), *ratio])
    return pd.DataFrame(rows, columns=PREMISES.columns[1:])


LOCAL = 0.125
"""Largest fraction of the surface that moves, by MOVED of the peak, in a deformation that counts as local, as the paper
assumes it: its features are of ten coarse nodes, 5 to 7 % of its bodies', and here up to twice as many may move."""


def moved_share(fine: np.ndarray) -> float:
    """Return the mean fraction of nodes that move by more than MOVED of their sample's peak; fine : (k, n, 3) [m]."""
    moved = np.linalg.norm(fine, axis=2)
    return float((moved > MOVED * moved.max(axis=1, keepdims=True)).mean())


def choose_alike(db: Database) -> tuple[int, int]:
    """Choose two samples with different contacts, far apart, that are pressed in directions within 5° of each other.

    If there are no such two, those with the nearest directions are chosen. Contacts at ends and edges are left out.
    """
    contact_points = db.coarse_nodes[db.contact]
    directions = db.force / np.linalg.norm(db.force, axis=1, keepdims=True)
    distances = np.linalg.norm(contact_points[:, None] - contact_points[None], axis=2)
    angles = np.arccos(np.clip(directions @ directions.T, -1.0, 1.0))
    remote = distances.mean(axis=1) > np.median(distances.mean(axis=1))
    excluded = remote[:, None] | remote[None] | (distances == 0.0)
    angles[excluded] = np.inf
    nearly_parallel = angles <= np.radians(5.0)
    chosen = np.argmax(np.where(nearly_parallel, distances, -1.0)) if nearly_parallel.any() else np.argmin(angles)
    first, second = np.unravel_index(chosen, distances.shape)
    return int(first), int(second)


FEATURE_VECTORS = Table(
    "feature_vectors",
    "The feature vectors of two presses in the same direction at two contacts of each premise.",
    """
    premise features press contact: a premise, a kind of feature, and a press at a contact
    node axis: place of a coarse node in the vector, and axis of the world or of the contact's frame
    share_of_peak: displacement / largest of the sample
    """,
)


def feature_rows(db: Database, neighbours: int) -> pd.DataFrame:
    """Tabulate the vectors of each kind of feature for the two samples of ``choose_alike``; axis is 0, 1 or 2."""
    tables = []
    for name in FEATURES:
        features = features_of(db, name, neighbours)
        for press, sample in enumerate(choose_alike(db), 1):
            contact = int(db.contact[sample])
            vector = features.view(contact).feature(db.coarse_paper[sample]) / db.peaks[sample]
            node, axis = np.divmod(np.arange(len(vector)), 3)
            row = {"features": name, "press": press, "contact": contact, "node": node, "axis": axis}
            tables.append(pd.DataFrame(row | {"share_of_peak": vector}))
    return pd.concat(tables)


DATABASE_MEMORY = Table(
    "database_memory",
    "The memory of all that a query may need.",
    """
    premise features train: a premise, a kind of feature, and the number of training samples
    features_kb fine_kb matrix_kb orders_kb total_kb: features, fine displacements, A, orders, all [kB]
    """,
)


def memory_rows(db: Database, train: np.ndarray, options: FitOptions) -> pd.DataFrame:
    """Tabulate the memory [kB] that a query needs with each kind of feature, with node orders of all contacts."""
    training = gather(db.take(train), "paper", options)
    rows = []
    for name in FEATURES:
        known = DescribedSamples(training, name)
        matrix = inverse(gaussian(known.squared, known.scale))
        sizes = [known.described.nbytes, known.slots.nbytes, matrix.nbytes, _orders(known.features, db.coarse_surface)]
        rows.append([name, len(train), *(size / 1024 for size in sizes), sum(sizes) / 1024])
    return pd.DataFrame(rows, columns=DATABASE_MEMORY.columns[1:])


def _orders(features: Features, contacts: np.ndarray) -> int:
    """Return the size in bytes of the views of all ``contacts``, each array counted once."""
    views = [features.view(int(contact)) for contact in contacts]
    return sum({id(array): array.nbytes for view in views for array in view if array is not None}.values())


PREMISE_BODIES = Table(
    "premise_bodies",
    "How the body of each premise is made and held, and what share of its surface moves.",
    """
    premise body responses made_of held: its body, linear or not, solid or hollow, and how held
    contacts moved_share: contacts that can be pressed, and share of nodes that move by more than a tenth of the peak
    """,
)


TABLES = (PREMISES, PREMISE_BODIES, FEATURE_VECTORS, DATABASE_MEMORY)


def compare_premises(
    input: Any,
    say: Callable,
    sampled: list[str],
    bodies: dict[str, Body],
    settings: Premises,
    regression: Regression,
    seed: int,
) -> dict[str, pd.DataFrame]:
    """Compare features in all premises, for the rule of this name, and return TABLES by name.

    sampled : bodies with nonlinear samples, in ``input.databases``, each a premise of its own that has the body's name
    bodies : settings of bodies by name, with magnitudes, train and test where paper 1 has samples of them
    """
    options = FitOptions(**dict(regression), split="contacts", seed=seed)
    databases = {name: read(path) for name, path in zip(sampled, input.databases, strict=True)}
    rows_by_premise: list[list[pd.DataFrame]] = []
    for name in steps(say, "premise")([*databases, *settings.cases]):
        if case := settings.cases.get(name):
            body_row, counts, by_split, all_contacts = _linear_samples(name, case, bodies[case.body], settings, seed)
        else:  # each split holds out different ones of the same samples
            body_settings: Any = bodies[name]
            all_contacts, counts = databases[name], (body_settings.train, body_settings.test)
            body_row, by_split = [name, "nonlinear", "solid", "as the body"], [all_contacts] * settings.splits
        body_row += [len(np.unique(all_contacts.contact)), moved_share(all_contacts.fine)]
        rows_by_table = (
            _errors_of_splits(by_split, counts, settings, options),
            pd.DataFrame([body_row], columns=PREMISE_BODIES.columns[1:]),
            feature_rows(all_contacts, options.neighbours),
            memory_rows(by_split[0], np.arange(counts[0]), options),
        )
        rows_by_premise.append([rows.assign(premise=name) for rows in rows_by_table])
    by_table = zip(TABLES, zip(*rows_by_premise, strict=True), strict=True)
    return {table.name: pd.concat(rows)[table.columns] for table, rows in by_table}


def _linear_samples(
    name: str, premise: Case, body_settings: Body, settings: Premises, seed: int
) -> tuple[list[Any], tuple[int, int], list[Database], Database]:
    """Make the samples of a premise with linear responses, at other contacts for each split.

    Returns the first columns of its row of PREMISE_BODIES, the numbers of samples to train on and to hold out, the
    samples of each split, and one sample of every contact.
    """
    magnitudes, train, test = sample_counts(f"enrichment.premises.cases.{name}", premise, body_settings)
    prepared = prepare(name, premise, body_settings)
    peak_m = settings.peak_of_size * prepared.body.fine.size
    contacts = (train + test) // len(magnitudes)
    by_split = [prepared.database(contacts, magnitudes, peak_m, seed + number) for number in range(settings.splits)]
    all_contacts = prepared.database(len(prepared.contacts), [1.0], peak_m, seed)
    support = "as the body" if premise.anchors is None and premise.bed is None else "otherwise"
    return [premise.body, "linear", premise.made_of, support], (train, test), by_split, all_contacts


def _errors_of_splits(
    databases: Sequence[Database], counts: tuple[int, int], settings: Premises, options: FitOptions
) -> pd.DataFrame:
    """Split each of ``databases`` once, train and test on it, and tabulate the mean errors as ``summarise`` does."""
    errors: list[pd.DataFrame] = []
    for number, db in enumerate(databases):
        errors += split_errors(db, counts, number, options)
        errors += growing_errors(db, counts, number, options, settings.training_shares)
    return summarise(pd.concat(errors))
