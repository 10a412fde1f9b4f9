"""The functions `study` and `open_study`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from robsim.base import interrupt
from robsim.base.arrays import as_bool, as_integer
from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import InputError, Interrupted, format_value
from robsim.base.folder_lock import lock_folder
from robsim.engine.workers import check_progress
from robsim.run.experiment import Experiment
from robsim.studies import dask_cluster
from robsim.studies.plan_execution import MemorySink, Progress, check_plan, simulate_plan
from robsim.studies.study_plan import Plan, make_plan
from robsim.studies.study_result import StudyResult
from robsim.studies.study_store import StudyStore
from robsim.studies.study_text import read_plan
from robsim.studies.trajectory_store import count_trajectory_bytes, import_zarr

CHUNK = 4000  # runs that are simulated together, and stored in one file
MOST_CHUNK = 1_000_000
MOST_BYTES = 1e8  # of the instants of runs that are simulated together


def study(
    experiment: Experiment,
    runs: int | None = None,
    *,
    seed: int | None = None,
    start: Any = None,
    vary: Any = None,
    measures: bool = False,
    trajectories: int | None = None,
    store: str | os.PathLike[str] | None = None,
    resume: bool = False,
    client: Any = None,
    threads: int | None = None,
    chunk: int = CHUNK,
    progress: Progress | None = None,
) -> StudyResult:
    """Run an experiment many times, with other numbers, choices and starts, and return the study.

    runs      draws, each of which is run with every combination of what is in turn; None, and
              nothing else: as the table [study] of the experiment's file says
    seed      of all that is drawn, and of the noise; None: that of the experiment
    start     a sampler such as `LookAt`, `Uniform` for coordinates, starts (B, nq), or one (nq,)
    vary      {name: what it is}, with the dotted names of `Experiment.at`: a sampler (`Uniform`,
              `Normal`, `LogUniform`, `Sobol`, `Choice`, or `Plus` and `Times` of these), whose
              values are drawn anew for each draw; or values in turn, which every draw is run with:
              a list, {label: value}, or a `Grid`
    measures  whether the standard measures (`robsim.analysis.measures`) are taken of all instants
    trajectories
              every n-th instant of coordinates, velocities and errors that is kept in the store
    store     folder for the rows, which are written some at a time; what is stopped goes on with
              `resume`, to the same bits. None: they are kept in memory
    client    of dask.distributed, whose workers simulate the runs; see docs/studies.md
    threads   how many; None for one per processor
    chunk     how many runs are simulated together, and are one file of a store
    progress  called now and then with the share that is done, 0 to 1

    A focal length that is drawn below 10 is a factor of the one that the experiment has, as in
    `Scene.believe`. Results have the same bits for any threads, chunk and client.

    InputError before anything runs; Interrupted after a stop, whose `run` is the study so far.

    >>> from robsim.samplers import Choice
    >>> from robsim.starts import LookAt
    >>> from robsim import examples, load_scenario
    >>> one = load_scenario(examples.path("visp_tutorial")).with_(duration=8)
    >>> found = study(one, 20, start=LookAt(distance=(0.5, 1)), vary={"task.gain": Choice([1, 2])})
    >>> len(found.table), found.visible.value
    (20, 1.0)
    """
    given = (runs, seed, start, vary, trajectories)
    said_in_file = all(each is None for each in given) and not measures
    if said_in_file and isinstance(experiment, Experiment) and experiment.study is not None:
        plan = read_plan(experiment)
        trajectories = plan.trajectories
    else:
        plan = make_plan(experiment, runs, seed, start, vary, trajectories, measures)
    if as_bool(resume, "resume") and store is None:
        raise InputError("resume: which study? give the folder that holds it, store=folder")
    how: Any = (resume, client, threads, chunk, progress)
    if trajectories is not None and store is None:
        raise InputError("trajectories: they are kept in a store; give its folder, store=folder")
    if store is None:
        return run_plan(plan, None, *how)
    folder = _make_folder(store)
    with lock_folder(folder):
        return run_plan(plan, folder, *how)


def run_plan(
    plan: Plan,
    folder: Path | None,
    resume: bool,
    client: Any,
    threads: int | None,
    chunk: int,
    progress: Progress | None,
) -> StudyResult:
    """Run a plan into a folder that is ours, or into memory; see `study`."""
    check_progress(progress)
    size = _choose_chunk_size(plan, chunk)
    threads = None if threads is None else as_integer(threads, "threads", 1, 1025)
    if client is not None:
        dask_cluster.check_client(client)
    sink: Any = MemorySink(plan.runs, plan.measures) if folder is None else StudyStore(folder)
    with interrupt.defer_stops(begun=False):
        check_plan(plan)
        if folder is not None:
            sink.begin(plan, resume)
        if client is None:
            complete = simulate_plan(plan, sink, size, threads, progress)
        else:
            complete = dask_cluster.simulate_on_cluster(plan, sink, size, client, progress)
    made = StudyResult(plan, lambda: sink.facts(plan), folder)
    if not complete:
        more = f"; resume=True goes on in {folder}" if folder else ""
        raise Interrupted(f"stopped by the user; the runs that are done are in .run{more}", made)
    return made


def _choose_chunk_size(plan: Plan, chunk: int) -> int:
    """Return how many runs are simulated together: fewer where all their instants are kept."""
    size = as_integer(chunk, "chunk", 1, MOST_CHUNK + 1)
    if plan.trajectories:
        import_zarr()
        size = min(size, max(1, int(MOST_BYTES // count_trajectory_bytes(plan))))
    return size


def _make_folder(path: Any) -> Path:
    """Return a folder, which is made; InputError or FileError: it cannot be one."""
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"store: expected a folder, got {format_value(path)}")
    with convert_os_errors(path):
        Path(path).mkdir(parents=True, exist_ok=True)
    return Path(path)


def open_study(path: str | os.PathLike[str]) -> StudyResult:
    """Return the study that a folder holds, also one that is not complete.

    FileError: there is none, or one of a newer version, or rows that are not as written.

    >>> open_study("nowhere")
    Traceback (most recent call last):
    robsim.base.errors.FileError: nowhere: there is no study: it has no study.json
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"expected the folder of a study, got {format_value(path)}")
    store = StudyStore(Path(path))
    plan = store.plan()
    return StudyResult(plan, lambda: store.facts(plan), store.folder)
