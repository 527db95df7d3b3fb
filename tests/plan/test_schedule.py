"""Jobs follow each other in thought as snakemake runs them."""

import pytest

from palpate.plan.schedule import follow
from palpate.plan.work import Job


@pytest.mark.parametrize(("cores", "ends"), [(1, 10.0), (2, 6.0), (3, 4.0), (8, 4.0)])
def test_independent_jobs_share_the_cores(cores, ends):
    assert follow([Job("a")] * 4, [4.0, 2.0, 2.0, 2.0], [1.0] * 4, cores).seconds == ends


def test_a_chain_takes_the_sum_of_its_jobs_on_any_machine():
    chain = [Job("a"), Job("b", after=(0,)), Job("c", after=(1,))]
    assert follow(chain, [1.0, 2.0, 3.0], [1.0] * 3, 8).seconds == 6.0


def test_a_job_that_wants_all_cores_runs_alone():
    jobs = [Job("a"), Job("alone", threads=8), Job("b")]
    course = follow(jobs, [3.0, 5.0, 3.0], [100.0, 500.0, 100.0], 2)
    assert course.seconds == 8.0
    assert course.memory_mb == 500.0


def test_memory_is_that_of_what_runs_at_one_time():
    jobs = [Job("a"), Job("b"), Job("c", after=(0, 1))]
    assert follow(jobs, [1.0, 2.0, 1.0], [10.0, 20.0, 25.0], 2).memory_mb == 30.0
    assert follow(jobs, [1.0, 2.0, 1.0], [10.0, 20.0, 25.0], 1).memory_mb == 25.0


def test_nothing_takes_no_time():
    assert follow([], [], [], 2) == (0.0, 0.0)
