"""Every way to get a file of answers wrong has one sentence; good and merely bad answers are never refused."""

import re
import zipfile

import h5py
import numpy as np
import pytest

from palpate.errors import InputError
from palpate.exchange.answers import read_answers
from palpate.exchange.judging import score_answers

MOVED, SECONDS, FAILED = "setting_2/displacement_m", "setting_2/seconds", "setting_2/failed"


def put(**values):
    """Replace arrays; ``at_`` stands for setting_2/, None takes one away."""

    def change(found, questions):
        for key, value in values.items():
            name = key.replace("at_", "setting_2/")
            found.pop(name, None)
            if value is not None:
                found[name] = np.array(value(found, questions) if callable(value) else value)

    return change


def moved(function):
    """Change the displacements of all settings."""

    def change(found, questions):
        for i in range(3):
            name = f"setting_{i}/displacement_m"
            found[name] = function(found[name], questions)

    return change


def entry(name, where, value):
    def change(found, questions):
        found[name] = np.array(found[name], dtype=float)
        found[name][where] = value

    return change


def own(nodes=None, triangles=None):
    """Answer on a mesh of one's own, that of the asked points, with a fault in it."""

    def change(found, questions):
        asked = questions.arrays["asked"]
        found["setting_2/nodes_m"] = asked["points_m"] if nodes is None else nodes(asked["points_m"])
        found["setting_2/triangles"] = asked["triangles"] if triangles is None else triangles(asked["triangles"])

    return change


def shuffled(u, questions):
    return u[:, np.random.default_rng(0).permutation(u.shape[1])]


def rolled(found, questions):
    """Answer the loads of the second contact first."""
    found["setting_0/failed"] = found["setting_0/failed"][[2, 3, 0, 1]]
    for i in range(3):
        found[f"setting_{i}/displacement_m"] = found[f"setting_{i}/displacement_m"][[2, 3, 0, 1]]


def exchanged(found, questions):
    """Answer the second load at the first contact before the first one, in every setting."""
    assert np.array_equal(*questions.arrays["loads"]["place_m"][2:])
    for i in range(3):
        found[f"setting_{i}/displacement_m"] = found[f"setting_{i}/displacement_m"][[0, 1, 3, 2]]


def own_nodes(found, questions):
    """Answer on a mesh of one's own whose nodes are in another order than the displacements."""
    own()(found, questions)
    found[MOVED] = shuffled(found[MOVED], questions)


FAULTS = {
    "no digest": (put(digest=None), r"digest is missing; add it"),
    "another digest": (put(digest="0" * 64), r"digest is of other questions than these, of block_large"),
    "palpate's own name": (put(engine="palpate"), r"engine is palpate, as tables call its own models"),
    "a setting that is a text": (put(settings="fine"), r"settings is text; give a list of texts"),
    "a setting twice": (put(settings=["a", "a", "b"]), r"settings has 'a' twice"),
    "a setting more": (put(settings=["a", "b", "c", "d"]), r"converged has 3 values for 4 settings"),
    "a misspelt field": (put(at_second=1.0), r"setting_2/second is no name .*; did you mean setting_2/seconds\?$"),
    "a NaN": (entry(MOVED, (1, 7, 2), np.nan), r"displacement_m is not finite in question 1; mark that as failed"),
    "a solver that burst": (entry(MOVED, (2, 3, 1), 1e300), r"displacement_m is 1e\+300 m in question 2; give NaN for"),
    "failed and answered": (
        put(at_failed=[True, False, False, False]),
        r"failed marks question 0, which has an answer",
    ),
    "one time for all": (put(at_seconds=0.5), r"seconds has the shape \(\); give \(4,\)"),
    "a negative time": (entry(SECONDS, (2, 0), -0.1), r"seconds has -0.1 s; give times above 0"),
    "a negative preparation": (put(at_preparation_s=-1.0), r"preparation_s is \[-1.0\]; give one number of 0 or more"),
    "nodes without triangles": (put(at_nodes_m=np.zeros((4, 3))), r"setting_2/triangles is missing; add it, as README"),
    "a node that is nowhere": (own(nodes=lambda x: np.where(x == x[0, 0], np.nan, x)), r"nodes_m is not finite"),
    "triangles from 1 on": (own(triangles=lambda t: t + 1), r"triangles names nodes that nodes_m does not have"),
    "a mesh in millimetres": (own(nodes=lambda x: 1000 * x), r"nodes_m lies between .* m; the body lies between"),
    "triangles of one corner": (own(triangles=lambda t: t[:3]), r"triangles has nodes between .* m; the body lies"),
    "a mesh in another order": (own_nodes, r"has the lengths of the truth at other points"),
    "millimetres": (moved(lambda u, q: 1000 * u), r"displacement_m is \d+ times the truth, as if in millimetres"),
    "x, y and z in another order": (moved(lambda u, q: u[..., [1, 2, 0]]), r"if its x, y, z are taken as z, x, y;"),
    "the other way": (moved(lambda u, q: -u), r"points against the force"),
    "positions": (moved(lambda u, q: u + q.points), r"holds positions and not displacements; subtract"),
    "points in another order": (moved(shuffled), r"has the lengths of the truth at other points"),
    "loads in another order": (rolled, r"has in question \d the answer to question \d; keep the order"),
    "two loads at one contact exchanged": (exchanged, r"has in question \d the answer to question \d; keep the order"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_faulty_file_has_one_sentence(questions, answers, tmp_path, fault):
    change, said = FAULTS[fault]
    change(answers, questions)
    np.savez(tmp_path / "a.npz", **answers)
    with pytest.raises(InputError) as told:
        score_answers(tmp_path / "a.npz", questions, questions.truth)
    sentence = str(told.value)
    assert re.search(said, sentence), sentence
    assert sentence.startswith(f"{tmp_path / 'a.npz'}: ") and sentence.endswith((".", "?")) and "\n" not in sentence
    assert len(sentence.removeprefix(str(tmp_path))) < 300


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "neither .npz nor HDF5"),
        (b"displacement, 1, 2", "neither .npz nor HDF5"),
        (b"PK\x03\x04 torn off", "is no file of answers"),
        (b"\x89HDF\r\n\x1a\n torn off", "is no file of answers"),
        (None, "cannot be read"),
    ],
)
def test_what_is_no_file_of_answers_is_said(questions, tmp_path, content, said):
    if content is not None:
        (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(InputError, match=said):
        read_answers(tmp_path / "a.npz", questions, {})


@pytest.mark.parametrize("kind", ["npz", "h5"])
def test_an_array_that_claims_to_be_huge_is_not_read(questions, answers, tmp_path, kind):
    path, shape = tmp_path / f"a.{kind}", (4, 10**11, 3)
    if kind == "npz":
        with zipfile.ZipFile(path, "w") as archive, archive.open(f"{MOVED}.npy", "w") as file:
            np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": shape})
    else:
        with h5py.File(path, "w") as file:
            file.create_dataset(MOVED, shape, dtype="f8", chunks=(1, 1000, 3))
    with pytest.raises(InputError, match=r"displacement_m of the shape \(4, 1\d+, 3\) would take more than 4 GB"):
        read_answers(path, questions, {})


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (moved(lambda u, q: 0.0 * u), "displacement_m is 0 everywhere."),
        (moved(lambda u, q: u + 0.2 * np.nanmax(abs(u))), "displacement_m moves points that are held by up to"),
        (moved(lambda u, q: np.nan * u), "displacement_m has no answer to any question with a truth."),
    ],
)
def test_what_is_odd_and_may_be_no_slip_is_scored_and_said(questions, answers, tmp_path, change, said):
    change(answers, questions)
    answers |= {f"setting_{i}/failed": np.isnan(answers[f"setting_{i}/displacement_m"]).all((1, 2)) for i in range(3)}
    np.savez(tmp_path / "a.npz", **answers)
    found = score_answers(tmp_path / "a.npz", questions, questions.truth)
    assert len(found.settings) == 3 and [said in each for each in found.warnings] == [True] * 3


def test_objects_and_groups_are_no_answers(questions, answers, tmp_path):
    np.savez(tmp_path / "a.npz", **answers | {"engine": np.array({"name": "mine"}, dtype=object)})
    with pytest.raises(InputError, match="it holds Python objects"):
        read_answers(tmp_path / "a.npz", questions, {})
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["setting_0/settings"] = 1.0
    with pytest.raises(InputError, match="digest is missing"):
        read_answers(tmp_path / "a.h5", questions, {})


@pytest.mark.parametrize("bad", ["zero", "noise", "rigid", "exploded"])
def test_an_answer_that_is_only_bad_is_scored(questions, answers, tmp_path, bad):
    """No engine is refused for being wrong: only slips of an adapter are."""
    truth, random = questions.truth["displacement_m"], np.random.default_rng(1)
    size = np.abs(truth).max()
    made = {
        "zero": 0.0 * truth,
        "noise": size * random.normal(size=truth.shape), "rigid": np.broadcast_to([0.0, 0.0, -size], truth.shape),
        "exploded": 1e6 * random.normal(size=truth.shape),
    }[bad]  # fmt: skip
    answers["setting_2/displacement_m"] = made
    np.savez(tmp_path / "a.npz", **answers)
    row = score_answers(tmp_path / "a.npz", questions, questions.truth).settings.iloc[2]
    assert row["relative_l2"] == pytest.approx(
        np.mean(np.linalg.norm(made - truth, axis=(1, 2)) / np.linalg.norm(truth, axis=(1, 2)))
    )
