"""`make slurm-test`: the smoke run on a SLURM cluster that loses a node, and the same tables as on this machine."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from cluster import NODES, Cluster, missing, running

sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))
from compare_results import differences

ROOT = Path(__file__).parents[2]
HERE, THERE = ROOT / ".smoke", ROOT / ".slurm"
SMOKE = ROOT / "tests/smoke/config.yaml"
DONE_BEFORE = 12
"""Jobs that have ended when the power of a node goes: by then both nodes are at work."""
PATIENCE_S = 3600


def snakemake(folder: Path, profile: str, *more: str) -> list[str]:
    """The command for a smoke run with its results in ``folder``."""
    profile = str(ROOT / "profiles" / profile)
    places = ["--snakefile", str(ROOT / "Snakefile"), "--directory", str(folder), "--configfile", str(SMOKE)]
    profiles = ["--profile", str(ROOT / "profiles/default"), "--workflow-profile", profile]
    return [sys.executable, "-m", "snakemake", *places, *profiles, *more]


def main() -> int:
    """0 if the tables are the same, or no cluster can be started here."""
    if why := missing():
        print(f"slurm-test is skipped: {why}.")
        return 0
    print("The smoke run on this machine ...", flush=True)
    subprocess.run(snakemake(HERE, "default"), check=True)
    print("The same on a cluster of two nodes ...", flush=True)
    with running(THERE / "slurm", cores=2) as cluster:
        jobs = sum("COMPLETED" in line for line in finish(cluster))
        states = dict(line.split() for line in cluster.tell("sinfo", "-h", "-N", "-o", "%N %T").splitlines())
    found = differences(HERE / "results/tables", THERE / "results/tables")
    print("\n".join(found or [f"slurm-test passed: {jobs} jobs, nodes {states}, the same tables."]))
    return len(found)


def finish(cluster: Cluster) -> list[str]:
    """Run everything anew on the cluster, and cut the power of its second node on the way; SLURM's list of jobs."""
    swift = ["--forceall", "--cores", "2", "--slurm-init-seconds-before-status-checks", "3"]
    # a cluster without accounts and without a data base of past jobs
    plain = ["--slurm-no-account", "--slurm-status-command", "squeue"]
    words = snakemake(THERE, "slurm", *swift, *plain)
    log = THERE / "snakemake.log"
    with open(log, "w") as out:
        process = subprocess.Popen(words, stdout=out, stderr=out, env=cluster.environment)
    deadline, cut = time.monotonic() + PATIENCE_S, False
    try:
        while process.poll() is None and time.monotonic() < deadline:
            time.sleep(1)
            jobs = cluster.tell("squeue", "-h", "-t", "all", "-o", "%T %N").splitlines()
            busy = f"RUNNING {NODES[1]}" in jobs
            if not cut and busy and sum("COMPLETED" in job for job in jobs) >= DONE_BEFORE:
                print(f"... {NODES[1]} loses its power", flush=True)
                cluster.cut_power(NODES[1])
                cut = True
    finally:
        process.kill()  # if it is still at it; told to stop, it would wait for its jobs
        process.wait()
    if process.returncode or not cut:
        print("\n".join(log.read_text().splitlines()[-40:]))
        raise SystemExit("the run on the cluster failed" if cut else f"nothing ever ran on {NODES[1]}")
    return cluster.tell("squeue", "-h", "-t", "all", "-o", "%T %N").splitlines()


if __name__ == "__main__":
    os.chdir(ROOT)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that no daemon outlives a run that is stopped
    sys.exit(main())
