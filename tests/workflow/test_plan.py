"""A run says what it will cost before it begins, and a dry run says it, too."""

import re

TARGET = ("--", "results/data/bar/body.h5")


def said(done) -> list[str]:
    assert done.returncode == 0, done.stdout
    return [line for line in done.stdout.splitlines() if " to do: " in line]


def test_a_dry_run_says_what_the_run_would_cost(run, smoke, write_config, tmp_path):
    done = run(tmp_path, write_config(smoke), "--dry-run")
    [line] = said(done)
    time = r"about (a minute|\d+ minutes)"
    assert re.fullmatch(rf"\d+ jobs to do: {time} on 2 cores of this machine, up to 0\.\d GB of memory", line)
    steps = int(re.search(r"^total +(\d+)$", done.stdout, re.M)[1])
    assert int(line.split()[0]) == steps - 1  # the last one only asks for the others


def test_a_run_says_it_first(run, smoke, write_config, tmp_path):
    done = run(tmp_path, write_config(smoke), *TARGET)
    [line] = said(done)
    assert line.startswith("1 job to do: about a minute on 2 cores of this machine, up to 0.3 GB")
    assert done.stdout.index(line) < done.stdout.index("make body (bar)")
    again = run(tmp_path, write_config(smoke), "--dry-run", *TARGET)
    assert said(again) == ["nothing to do: everything that was asked for is up to date"]
