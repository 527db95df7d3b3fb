"""The runtimes in C and JavaScript answer as the one in Python, and stand files that were changed."""

import json
import subprocess
import warnings

import numpy as np
import pytest
from press.portable.conftest import headed

CLOSE = 1e-5
ASK = """
const Palpate = require(process.argv[1]), fs = require("fs"), whole = fs.readFileSync(process.argv[2]);
const model = Palpate.load(whole.buffer.slice(whole.byteOffset, whole.byteOffset + whole.length));
const found = JSON.parse(fs.readFileSync(process.argv[3])).map(([before, presses]) => {
  const from = before.length ? model.respond(before) : null;
  const {displacement, forces, error, doubt} = model.respond(presses, {from});
  return {displacement: Array.from(displacement), forces: Array.from(forces), error, doubt};
});
fs.writeFileSync(process.argv[4], JSON.stringify(found));
"""
REFUSE = """
const Palpate = require(process.argv[1]), fs = require("fs");
for (const path of process.argv.slice(2)) {
  const whole = fs.readFileSync(path);
  try { Palpate.load(whole.buffer.slice(whole.byteOffset, whole.byteOffset + whole.length)); console.log("read"); }
  catch (error) { console.log(error.constructor.name + ": " + error.message); }
}
"""
DEPTH = """
const [code, file, asked] = process.argv.slice(1), fs = require("fs"), Palpate = require(code);
const model = Palpate.load(fs.readFileSync(file));
console.log(JSON.stringify(JSON.parse(fs.readFileSync(asked)).map((press) => model.depth(press))));
"""
WRONG = """
const model = require(process.argv[1]).load(require("fs").readFileSync(process.argv[2]));
const press = { triangle: 0, weights: [1, 0, 0], force: [0, 0, 0] };
for (const presses of [Array(17).fill(press), [{ ...press, moved: [0, 0, 0] }], [null], undefined])
  try { model.respond(presses); console.log("answered"); } catch (error) { console.log(error.message); }
"""


def compare(expected, found, least):
    """Answers that were found, ``least`` or more, are the same; those that were not say so alike."""
    assert len(found) == len(expected)
    answered = [not right.doubt.startswith(("the model found no", "no force")) for right in expected]
    assert sum(answered) >= least
    for sure, right, (displacement, forces, error, doubt) in zip(answered, expected, found, strict=True):
        if not sure:
            assert doubt.split(":")[0] == right.doubt.split(":")[0]
            continue
        peak = np.linalg.norm(right.displacement, axis=1).max()
        assert np.abs(displacement.reshape(-1, 3) - right.displacement).max() <= CLOSE * peak
        assert np.abs(forces.reshape(-1, 3) - right.forces).max() <= CLOSE * np.abs(right.forces).max()
        assert error == pytest.approx(right.error, rel=1e-4)
        assert doubt == right.doubt


@pytest.fixture(scope="session")
def in_c(compiled, made_up, model, tmp_path_factory):
    """A function that asks the C runtime for loads, each after another one, or after none."""
    folder = tmp_path_factory.mktemp("asked")
    (folder / "model").write_bytes(made_up.data)
    files = [str(folder / name) for name in ("model", "loads", "answers")]

    def ask(drags):
        rows = []
        for before, presses in drags:
            for some, sign in ((before, 1), (presses, -1 if before else 1)):
                rows += [sign * len(some)] if some else []
                for press in some:
                    moves = "moved" in press
                    rows += [press["triangle"], *press["weights"], float(moves), *press["moved" if moves else "force"]]
        np.array(rows, dtype=float).tofile(folder / "loads")
        done = subprocess.run([compiled("ask"), *files], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        data, at, found = (folder / "answers").read_bytes(), 0, []
        for before, presses in drags:
            at += 184 + 24 * len(before) + 12 * len(model.nodes) if before else 0
            error = np.frombuffer(data, float, 3, at)[0]
            forces = np.frombuffer(data, float, 3 * len(presses), at + 24)
            at += 24 + 24 * len(presses)
            displacement = np.frombuffer(data, np.float32, 3 * len(model.nodes), at)
            at += 12 * len(model.nodes) + 160
            found.append((displacement, forces, error, data[at - 160 : at].split(b"\0")[0].decode()))
        return found

    return ask


@pytest.fixture(scope="session")
def in_javascript(node, made_up, tmp_path_factory):
    """The same for JavaScript."""
    folder = tmp_path_factory.mktemp("asked")
    (folder / "model").write_bytes(made_up.data)

    def ask(drags):
        (folder / "loads").write_text(json.dumps(drags))
        node(ASK, *(folder / name for name in ("model", "loads", "answers")))
        answers = json.loads((folder / "answers").read_text())
        return [(np.array(a["displacement"]), np.array(a["forces"]), a["error"], a["doubt"]) for a in answers]

    return ask


@pytest.fixture(params=[pytest.param("in_c", marks=pytest.mark.slow), "in_javascript"])
def runtime(request):
    return request.getfixturevalue(request.param)


def test_other_runtimes_answer_as_python(runtime, model, loads, cold, pairs):
    near = [model.respond(presses) for presses in pairs]
    for some, expected, least in ((loads, cold, 30), (pairs, near, len(pairs))):
        compare(expected, runtime([([], presses) for presses in some]), least)


@pytest.mark.slow
def test_other_runtimes_start_from_an_earlier_answer_as_python(runtime, drags, warm):
    compare(warm, runtime(drags), 30)


@pytest.mark.parametrize("given", ["force", "moved"])
def test_what_no_number_can_hold_is_answered_by_nothing_and_doubted_without_a_warning(runtime, model, given):
    loads = []
    for size in (1e100, 1e300, -1.7e308):
        press = {"triangle": 3, "weights": [0.2, 0.3, 0.5], given: [0.0, size, -size]}
        loads += [[press], [press, press | {"triangle": 90}]]
    with warnings.catch_warnings(action="error"):
        expected = [model.respond(presses) for presses in loads]
    answers = runtime([([], presses) for presses in loads])
    for right, found in zip(expected, answers, strict=True):
        assert right.error == 1.0
        assert right.doubt.startswith(("the numbers of this answer are beyond", "no force was found"))
        assert not right.displacement.any() and not found[0].any() and found[2:] == (right.error, right.doubt)
        assert found[1].tolist() == right.forces.ravel().tolist()


def test_javascript_says_how_deep_a_place_can_be_pressed(node, made_up, model, tmp_path):
    """A way straight in that takes as hard a force as the nearest contacts bear, if responses are linear."""
    presses = [{"triangle": t, "weights": [0.5, 0.3, 0.2]} for t in range(0, len(model.triangles), 5)]
    (tmp_path / "presses.json").write_text(json.dumps(presses))
    (tmp_path / "file").write_bytes(made_up.data)
    said = json.loads(node(DEPTH, tmp_path / "file", tmp_path / "presses.json"))
    expected = []
    for press in presses:
        place = model._place(press)
        hardest = sum(each.weight / np.linalg.norm(each.contact.bearing) for each in place.near)
        normal = press["weights"] @ model._normals[model.triangles[press["triangle"]]]
        metre = np.linalg.solve(place.disc @ model._compliance @ place.disc.T, normal / np.linalg.norm(normal))
        expected.append(hardest / np.linalg.norm(metre))
    assert min(expected) > 0
    np.testing.assert_allclose(said, expected, rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["data", "touched"])
def test_a_thousand_changed_files_are_refused_or_answer_finite_numbers(compiled, made_up, name, tmp_path):
    (tmp_path / "model").write_bytes(getattr(made_up, name))
    done = subprocess.run([compiled("fuzz"), str(tmp_path / "model"), "1000"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    refused, answered = map(int, done.stdout.split())
    assert refused + answered <= 1000 and refused > 200 and answered > 200


def test_javascript_refuses_what_is_no_press(node, made_up, tmp_path):
    (tmp_path / "model").write_bytes(made_up.data)
    assert node(WRONG, tmp_path / "model").splitlines() == [
        "more than 16 presses are asked for",
        "a press has a force or is moved, and not both",
        *2 * ["presses are a list of objects"],
    ]


def test_javascript_refuses_what_is_no_model(node, made_up, tmp_path):
    data = made_up.data
    named = {"body": "a", "regime": "b", "model": "c", "error": "d"}
    wrong = {"unnamed": headed(data, {}), "sizeless": headed(data, named), "short": data[:-5], "empty": b""}
    wrong |= {"other": b"text" * 99, "flipped": data[:-9] + b"\1" + data[-8:]}
    for name, each in wrong.items():
        (tmp_path / name).write_bytes(each)
    said = node(REFUSE, *(tmp_path / name for name in wrong)).splitlines()
    assert len(said) == len(wrong) and all(line.startswith("Error: ") for line in said)
    assert said[:2] == [
        f"Error: its header lacks {what}" for what in ("body, which is a text", "radius_m, which is a number")
    ]
