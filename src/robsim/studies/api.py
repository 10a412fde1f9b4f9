"""The functions `study` and `open_study`."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from robsim.base import interrupt
from robsim.base.arrays import as_bool, as_integer
from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import InputError, Interrupted, format_value
from robsim.base.folder_lock import lock_folder
from robsim.engine.workers import check_progress
from robsim.run.experiment import Experiment
from robsim.starts.start_samplers import Start
from robsim.studies import dask_cluster
from robsim.studies.dask_cluster import ClusterClient
from robsim.studies.plan_execution import MemorySink, Progress, StudySink, check_plan, simulate_plan
from robsim.studies.samplers import Uniform
from robsim.studies.study_plan import Plan, make_plan
from robsim.studies.study_result import StudyResult
from robsim.studies.study_store import StudyStore
from robsim.studies.study_text import read_plan
from robsim.studies.trajectory_store import count_trajectory_bytes, import_zarr

CHUNK = 4000  # runs that are simulated together and stored in one file
MOST_CHUNK = 1_000_000
MOST_BYTES = 1e8  # most memory for the stored instants of a chunk


def study(
    experiment: Experiment,
    runs: int | None = None,
    *,
    seed: int | None = None,
    start: Start | Uniform | ArrayLike | Mapping[str, ArrayLike] | None = None,
    vary: Mapping[str, object] | None = None,
    measures: bool = False,
    trajectories: int | None = None,
    store: str | os.PathLike[str] | None = None,
    resume: bool = False,
    client: ClusterClient | None = None,
    threads: int | None = None,
    chunk: int = CHUNK,
    progress: Progress | None = None,
) -> StudyResult:
    """Simulate an experiment many times with varied numbers, choices and starts.

    A study consists of draws. A draw is a random start with a sample of every random number; it is
    simulated with each combination of the enumerated values (lists and grids). All results have the
    same bits for any `threads`, `chunk` and `client`. Focal lengths are in pixels; `Product`
    samples factors of the focal length of the experiment.

    Parameters
    ----------
    experiment : Experiment
        Experiment with a single start.
    runs : int, optional
        Number of draws. Default: the number of given starts. If `runs`, `seed`, `start`, `vary`,
        `measures` and `trajectories` are omitted, the table [study] of the experiment's file is the
        plan.
    seed : int, optional
        Seed of the samples and of the noise. Default: the seed of the experiment.
    start : sampler, array_like of shape (nq,) or (B, nq), optional
        Sampler of starts such as `LookAt`, `Uniform` for coordinates, or given starts, one for each
        draw. Default: the start of the experiment.
    vary : mapping of str to object, optional
        Varied values by the dotted names of `Experiment.at`. A sampler (`Uniform`, `Normal`,
        `LogUniform`, `Sobol`, `Choice`, or `Sum` and `Product` of a sampler) gives each draw a new
        value. A list, a mapping {label: value} or a `Grid` is enumerated: every draw is simulated
        with each of its values.
    measures : bool, default False
        Whether to compute the standard measures (`robsim.analysis.measures`) of each run.
    trajectories : int, optional
        Store every n-th instant of coordinates, velocities and errors. Requires `store`.
    store : path-like, optional
        Folder for the rows, which are written in chunks. Default: the rows stay in memory.
    resume : bool, default False
        Whether to complete a stopped study in `store`; the result has the same bits.
    client : dask.distributed.Client, optional
        Cluster that simulates the runs; see docs/studies.md.
    threads : int, optional
        Number of threads. Default: one for each processor.
    chunk : int, default 4000
        Number of runs that are simulated together and stored in one file.
    progress : callable, optional
        Function that is called with the finished share, 0 to 1.

    Returns
    -------
    StudyResult
        The runs as a table, and statistics of them.

    Raises
    ------
    InputError
        If the study cannot be simulated. The plan is checked before the first simulation.
    FileError
        If `store` cannot be written, or holds another study.
    Interrupted
        After a stop; its `run` is the study of the finished runs.

    Examples
    --------
    >>> from robsim.samplers import Choice
    >>> from robsim.starts import LookAt
    >>> from robsim import examples, load_scenario
    >>> one = load_scenario(examples.path("visp_tutorial")).with_(duration=8)
    >>> result = study(one, 20, start=LookAt(distance=(0.5, 1)), vary={"task.gain": Choice([1, 2])})
    >>> len(result.table), result.visible.value
    (20, 1.0)
    """
    arguments = (runs, seed, start, vary, trajectories)
    uses_file = all(each is None for each in arguments) and not as_bool(measures, "measures")
    if uses_file and isinstance(experiment, Experiment) and experiment.study is not None:
        plan = read_plan(experiment)
        trajectories = plan.trajectories
    else:
        plan = make_plan(experiment, runs, seed, start, vary, trajectories, measures)
    if as_bool(resume, "resume") and store is None:
        raise InputError("resume: give the folder of the study, store=folder")
    how: Any = (resume, client, threads, chunk, progress)
    if trajectories is not None and store is None:
        raise InputError("trajectories: they need a store; give its folder, store=folder")
    if store is None:
        return run_plan(plan, None, *how)
    with _claim_folder(store) as folder:
        return run_plan(plan, folder, *how)


def run_plan(
    plan: Plan,
    folder: Path | None,
    resume: bool,
    client: ClusterClient | None,
    threads: int | None,
    chunk: int,
    progress: Progress | None,
) -> StudyResult:
    """Simulate a plan, with its results in a locked folder or in memory; see `study`."""
    check_progress(progress)
    size = _choose_chunk_size(plan, chunk)
    threads = None if threads is None else as_integer(threads, "threads", 1, 1025)
    if client is not None:
        dask_cluster.check_client(client)
    store = None if folder is None else StudyStore(folder)
    sink: StudySink = store or MemorySink(plan.runs, plan.measures)
    with interrupt.defer_stops(begun=False):
        check_plan(plan)
        if store is not None:
            store.begin(plan, resume)
        if client is None:
            complete = simulate_plan(plan, sink, size, threads, progress)
        else:
            complete = dask_cluster.simulate_on_cluster(plan, sink, size, client, progress)
    result = StudyResult(plan, lambda: sink.facts(plan), folder)
    if not complete:
        hint = f"; resume=True continues in {folder}" if folder else ""
        raise Interrupted(f"stopped by the user; the finished runs are in .run{hint}", result)
    return result


def _choose_chunk_size(plan: Plan, chunk: int) -> int:
    """Return the number of runs per chunk, fewer if their instants are stored."""
    size = as_integer(chunk, "chunk", 1, MOST_CHUNK + 1)
    if plan.trajectories:
        import_zarr()
        size = min(size, max(1, int(MOST_BYTES // count_trajectory_bytes(plan))))
    return size


@contextmanager
def _claim_folder(path: Any) -> Iterator[Path]:
    """Create and lock a folder; a new folder is removed if it is empty after an error.

    Raise InputError or FileError if that is impossible.
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"store: expected a folder, got {format_value(path)}")
    folder = Path(path)
    with convert_os_errors(path):
        is_new = not folder.exists()
        folder.mkdir(parents=True, exist_ok=True)
    try:
        with lock_folder(folder):
            yield folder
    except BaseException:
        with suppress(OSError):  # it is not empty
            if is_new:
                folder.rmdir()
        raise


def open_study(path: str | os.PathLike[str]) -> StudyResult:
    """Open the study in a folder, complete or not.

    Parameters
    ----------
    path : path-like
        Folder of the study.

    Returns
    -------
    StudyResult
        The study; its rows are read on demand.

    Raises
    ------
    FileError
        If the folder holds no study, a study of a newer format, or damaged rows.

    Examples
    --------
    >>> open_study("nowhere")
    Traceback (most recent call last):
    robsim.base.errors.FileError: nowhere: no study here: study.json is missing
    """
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"expected the folder of a study, got {format_value(path)}")
    store = StudyStore(Path(path))
    plan = store.plan()
    return StudyResult(plan, lambda: store.facts(plan), store.folder)
