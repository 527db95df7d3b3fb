"""Divide samples into those to train on and those to hold out."""

import numpy as np

from palpate.errors import InputError


def split(contact: np.ndarray, train: int, test: int, kind: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Divide the samples into ``train`` and ``test`` ones; return both as increasing sample numbers.

    contact : (k,) contact node of each sample, k = train + test
    kind : "samples" holds out random samples (the paper's), "contacts" whole contact nodes
    Raises InputError for an empty side, counts that do not add up to k, and, with "contacts", counts that no
    set of whole contacts has.
    """
    k = len(contact)
    if train < 1 or test < 1:
        raise InputError(f"split: train {train} and test {test} must both be at least 1.")
    if train + test != k:
        raise InputError(f"split: train {train} and test {test} must add up to the {k} samples there are.")
    random = np.random.default_rng(seed)
    if kind == "samples":
        order = random.permutation(k)
        return np.sort(order[test:]), np.sort(order[:test])
    if kind != "contacts":
        raise InputError(f"split: kind {kind!r} is unknown; use samples or contacts.")
    held_out = np.isin(contact, _contacts_with(contact, test, random))
    return np.flatnonzero(~held_out), np.flatnonzero(held_out)


def _contacts_with(contact: np.ndarray, wanted: int, random: np.random.Generator) -> np.ndarray:
    """Choose a random set of contacts that has exactly ``wanted`` samples, by dynamic programming over the sums."""
    nodes, counts = np.unique(contact, return_counts=True)
    reached: dict[int, list[int]] = {0: []}
    for i in random.permutation(len(nodes)):
        for total in sorted(reached, reverse=True):
            larger = total + counts[i]
            if larger <= wanted and larger not in reached:
                reached[larger] = [*reached[total], i]
    if wanted not in reached:
        raise InputError(f"split: no set of whole contacts has {wanted} test samples; make test a multiple of those.")
    return nodes[reached[wanted]]
