"""Simulations share threads: nested, stopped and failed ones, and those of a forked process."""

import multiprocessing
import os
import sys
import threading
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.engine import thread_pool
from robsim.files import examples

TUTORIAL = rs.load_scenario(examples.path("visp_tutorial")).with_(duration=4.0)
STARTS = np.stack([TUTORIAL.start + 0.001 * i * np.eye(7)[0] for i in range(6)])
BATCH = TUTORIAL.with_(start=STARTS)


def run_batch(threads=3):
    return BATCH.run(threads=threads, chunk=1)


def count_threads():
    return sum(each.name.startswith("robsim") for each in threading.enumerate())


def test_the_next_simulation_uses_the_same_threads():
    first = run_batch()
    before = count_threads()
    assert before >= 1 and all(run_batch().identical(first) for _ in range(5))
    assert count_threads() <= max(before, 3)


@pytest.mark.parametrize("threads", [1, 2, 6, 100])
def test_the_number_of_threads_does_not_change_the_run(threads):
    assert run_batch(threads).identical(BATCH.run(threads=1))


def test_a_progress_function_may_simulate():
    inner = []

    def nest(share):
        if len(inner) < 3:
            inner.append(run_batch())

    outer = BATCH.run(nest, threads=2, chunk=1)
    assert inner and all(each.identical(outer) for each in inner)


def test_stages_in_all_threads_may_simulate():
    expected, inner = TUTORIAL.with_(duration=0.4).run(), []

    class Nested:
        """The law of the tutorial, which simulates at every step."""

        def command(self, state):
            if len(inner) < 12:
                inner.append(TUTORIAL.run(lambda share: None, duration=0.4, threads=2))
            return rs.laws.JointLaw().command(state)

    case = BATCH.with_(duration=0.2).with_(task=replace(BATCH.task, law=Nested()))
    case.run(threads=6, chunk=1)
    assert len(inner) >= 6 and all(each.identical(expected) for each in inner)


def test_threads_of_a_user_may_simulate_at_once():
    expected = run_batch()
    with ThreadPoolExecutor(8) as pool:
        runs = list(pool.map(lambda _: run_batch(), range(24)))
    assert all(each.identical(expected) for each in runs)


def test_an_error_of_a_progress_function_ends_all_threads():
    def fail(share):
        raise ValueError("own")

    with pytest.raises(ValueError, match="own"):
        BATCH.run(fail, threads=3, chunk=1)
    assert thread_pool.SHARED._users == 0 and run_batch().identical(BATCH.run(threads=1))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_forked_process_simulates_with_threads_of_its_own():
    expected = run_batch()
    assert count_threads()
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # Python warns of a fork beside threads
        with multiprocessing.get_context("fork").Pool(2) as processes:
            assert count_threads() == 0
            outcomes = processes.map_async(_count_ends, range(4)).get(60)
    assert outcomes == [float(expected.end_time.sum())] * 4
    assert run_batch().identical(expected)


def _count_ends(_):
    return float(run_batch().end_time.sum())


@pytest.mark.full
def test_a_process_ends_with_idle_threads():
    import subprocess

    code = (
        "import robsim as rs; e = rs.load_scenario(rs.examples.path('visp_tutorial'));"
        "print(float(e.run(lambda share: None, duration=0.4).end_time))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stdout == "0.4\n"


def test_many_threads_end_with_their_simulation(monkeypatch):
    monkeypatch.setattr(thread_pool, "count_processors", lambda: 1)
    run_batch(threads=6)
    assert count_threads() == 0
