"""The claim on local meshes is judged by the error at the patch and the time, beside the coarse and the fine mesh."""

import pandas as pd

from palpate.studies.tradeoff.claims import local


def rows(local_error, local_s):
    stop = "start=frame, iterations=1"
    found = [
        ("fem_p2", f"level=0, {stop}", 0.10, 2e-3),
        ("fem_p2", f"level=1, {stop}", 0.05, 9e-3),
        ("fem_p2", f"level=2, {stop}", 0.02, 2e-1),
        ("fem_p2", "level=2, start=rest, tolerance=0.001", 0.02, 1.0),
        ("fem_local", f"depth=1, reach=1.5, order=2, {stop}", 0.07, 3e-3),
        ("fem_local", f"depth=2, reach=1.5, order=2, {stop}", local_error, local_s),
        ("zero", "default", 1.0, 1e-6),
    ]
    return pd.DataFrame(found, columns=["model", "setting", "patch_rms_of_peak", "online_median_s"]).assign(
        scene="liver_small", split=1
    )


def judged(table):
    return [claim.verdict for claim in local({"accuracy_vs_time": table})]


def test_it_holds_between_the_coarse_and_the_fine_mesh_only():
    assert judged(rows(0.06, 8e-3)) == ["confirmed"]
    assert judged(rows(0.11, 8e-3)) == ["refuted"]
    assert judged(rows(0.06, 0.3)) == ["refuted"]
    (claim,) = local({"accuracy_vs_time": rows(0.06, 8e-3)})
    assert claim.ours == "liver small: 10 % in 2 ms, 6 % in 8 ms, 2 % in 200 ms" and "level 2" in claim.premise
    table = rows(0.06, 8e-3)
    assert judged(table[table["model"] != "fem_local"]) == []  # without local meshes nothing is claimed


def test_answers_brought_to_the_limit_are_not_of_the_mesh():
    table = rows(0.06, 8e-3)
    limit = table[table["model"] == "fem_p2"].assign(patch_rms_of_peak=1e-3, online_median_s=1e-4)
    limit["setting"] = limit["setting"] + ", target=limit"
    both = pd.concat([table, limit], ignore_index=True)
    assert list(local({"accuracy_vs_time": both})) == list(local({"accuracy_vs_time": table}))
