"""The function `simulate`, which checks its input and lets threads take chunks of runs."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from robsim.base.arrays import Array, positive, whole
from robsim.base.errors import InputError, Interrupted
from robsim.base.interrupt import undisturbed
from robsim.base.threads import processors
from robsim.run.loop import Loop, OnStep
from robsim.run.outcome import Outcome
from robsim.run.record import LONGEST, Record
from robsim.servo.tasks.task import Task
from robsim.vision.camera import Visibility
from robsim.world.actuation import Actuation
from robsim.world.scene import Scene
from robsim.world.sensing import Sensing

if TYPE_CHECKING:
    import xarray as xr

T = TypeVar("T", Sensing, Actuation)
Progress = Callable[[float], None]

_BLIND = (Outcome.OUT_OF_IMAGE, Outcome.BEHIND_CAMERA)
_WHERE = {
    Visibility.BEHIND_CAMERA: "behind the camera",
    Visibility.OUT_OF_IMAGE: "outside the image",
}


def simulate(
    scene: Scene,
    task: Task,
    q0: Any = None,
    *,
    dt: float = 0.04,
    duration: float = 10.0,
    seed: int = 0,
    sensing: Sensing | None = None,
    actuation: Actuation | None = None,
    hold: bool = False,
    record: Record = "all",
    run: int = 0,
    threads: int | None = None,
    chunk: int = 256,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Close the loop from q0 and return what happened, as an xarray.Dataset.

    q0          start (nq,), or a batch of them (B, nq); or {robot: q}; None is home
    dt          control period in seconds: a command is held for it, and the motion is exact
    duration    seconds, rounded up to whole periods
    seed        of all that is random, with the number of the run and the step
    sensing     what is wrong with the images (`Sensing`: noise, latency, ...); None for nothing
    actuation   what is wrong with the joints (`Actuation`: lag, limits, ...); None for nothing
    hold        go on to the end of the duration, also after convergence: to follow what moves
    record      "all", every n-th step, or "summary": the end of each run
    run         number of the first run, to repeat one row of a batch alone with its noise
    threads     how many; None for one per processor. The result is the same for any number
    chunk       how many runs go in lockstep at most; the result is the same for any number
    progress    called now and then with the share that is done, 0 to 1

    After its end a run is NaN. InputError before anything runs; Interrupted after Ctrl-C.

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> run = simulate(scenario.scene, scenario.task, scenario.start, duration=25)
    >>> rs.Outcome(int(run.outcome)).name, round(float(run.error_norm[149]), 4)
    ('CONVERGED', 0.023)
    """
    from robsim.run.result import dataset

    check_progress(progress)
    chunk = whole(chunk, "chunk", 1)
    threads = whole(processors() if threads is None else threads, "threads", 1, 1025)
    loop = loop_of(
        scene,
        task,
        q0,
        dt=dt,
        duration=duration,
        seed=seed,
        sensing=sensing,
        actuation=actuation,
        hold=hold,
        record=record,
        run=run,
    )
    loop.controller.check_start(loop.q0)
    finished = _work(loop, threads, chunk, progress)
    with undisturbed() as stops:
        result = dataset(loop, scene, task)
    if stops or not finished:
        raise Interrupted("stopped by the user; what was simulated so far is in .run", result)
    return result


def loop_of(
    scene: Scene,
    task: Task,
    q0: Any = None,
    *,
    dt: float = 0.04,
    duration: float = 10.0,
    seed: int = 0,
    sensing: Sensing | None = None,
    actuation: Actuation | None = None,
    hold: bool = False,
    record: Record = "all",
    run: int = 0,
    on_step: OnStep | None = None,
) -> Loop:
    """Return the loop that `simulate` runs, checked; `on_step` is called after each step."""
    check_kinds(scene, task)
    controller = task.bind(scene)
    starts = scene.coordinates(scene.home if q0 is None else q0, "q0")
    if starts.ndim > 2 or starts.size == 0:
        raise InputError(f"q0: expected shape ({scene.nq},) or (B, {scene.nq}), got {starts.shape}")
    dt, duration = positive(dt, "dt (seconds)"), positive(duration, "duration (seconds)")
    return Loop(
        controller,
        np.ascontiguousarray(starts.reshape(-1, scene.nq)),
        dt,
        whole_periods(dt, duration),
        whole(seed, "seed", 0, 2**64),
        _instance(sensing, Sensing, "sensing"),
        _instance(actuation, Actuation, "actuation"),
        _flag(hold, "hold"),
        whole(run, "run", 0, 2**62),
        record,
        starts.ndim == 1,
        on_step,
    )


def check(
    scene: Scene,
    task: Task,
    q0: Any,
    settings: Mapping[str, Any],
    must_see: bool = False,
    starts: bool = True,
) -> None:
    """Raise InputError for what `simulate` refuses with these keywords, without a record.

    Without `starts` q0 is not yet where the task will start.
    With `must_see` also for a start at which the task lacks a mark, where a run ends at once.
    """
    later = {"record", "threads", "chunk", "progress"}
    now = {key: value for key, value in settings.items() if key not in later}
    loop = loop_of(scene, task, q0, record="summary", **now)
    if starts:
        loop.controller.check_start(loop.q0)
    if must_see:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the binding, which has just warned
            first = simulate(scene, task, q0, **{**now, "duration": loop.dt, "record": "summary"})
        blind = np.isin(first.outcome, _BLIND) & (first.end_time.values == 0)
        if blind.any():
            at = int(np.flatnonzero(np.atleast_1d(blind))[0])
            raise InputError(_unseen(loop, at))


def _unseen(loop: Loop, at: int) -> str:
    """Return which camera lacks which marks at a start."""
    which = f"start {at + 1} of {len(loop.q0)}" if len(loop.q0) > 1 else "start"
    for sight in loop.controller.sights:
        seen = sight.scene.view(loop.q0[at], sight.eye.name, sight.target.name).visibility
        for flag, where in _WHERE.items():
            marks = np.flatnonzero(seen == flag)
            if marks.size:
                named = f"mark{'s' * (marks.size > 1)} {', '.join(map(str, marks))}"
                return (
                    f"{which}: '{sight.eye.name}' does not see {named} of "
                    f"'{sight.target.name}': {where}"
                )
    return f"{which}: the camera does not see all marks"


def _work(loop: Loop, threads: int, chunk: int, progress: Progress | None) -> bool:
    """Let threads take chunks while this one waits for Ctrl-C; return False if it came."""
    chunk = min(chunk, math.ceil(len(loop.q0) / threads))
    chunks = [np.arange(i, min(i + chunk, len(loop.q0))) for i in range(0, len(loop.q0), chunk)]
    shares = np.zeros(len(chunks))
    weights = np.array([len(rows) for rows in chunks]) / len(loop.q0)
    jobs: list[Future[None]] = []
    with ThreadPoolExecutor(min(threads, len(chunks))) as pool:
        try:
            for i, rows in enumerate(chunks):
                jobs.append(pool.submit(loop.advance, rows, _cell(shares, i)))
            for _ in _until_done(jobs):
                if progress:
                    progress(float(shares @ weights))
        except KeyboardInterrupt:
            loop.stopped = True
            wait(jobs)
            return False
        finally:
            loop.stopped = True  # after an error in one chunk the others need not go on
    for job in jobs:
        job.result()
    return True


def _cell(shares: Array, i: int) -> Callable[[float], None]:
    def put(share: float) -> None:
        shares[i] = share

    return put


def _until_done(jobs: list[Future[None]]) -> Iterator[None]:
    """Yield about ten times a second until every job is done or one has failed."""
    pending = set(jobs)
    while pending:
        done, pending = wait(pending, timeout=0.1, return_when=FIRST_EXCEPTION)
        yield
        if any(job.exception() for job in done):
            return


def check_progress(progress: object) -> None:
    """Raise InputError unless a value is a function, or None."""
    if progress is not None and not callable(progress):
        raise InputError(f"progress: expected a function of the share done, got {progress!r:.80}")


def check_kinds(scene: object, task: object) -> None:
    """Raise InputError unless these are a Scene and a task."""
    if not isinstance(scene, Scene):
        raise InputError(f"scene: expected a Scene, got {scene!r:.80}")
    if isinstance(task, type) or not isinstance(task, Task):
        raise InputError(f"task: expected a task such as IBVS(...), got {task!r:.80}")


def whole_periods(dt: float, duration: float) -> int:
    """Return how many periods a duration has, at least one; InputError if too many or none."""
    if dt > duration:
        raise InputError(f"dt {dt:g} s is longer than the duration {duration:g} s")
    steps = duration / dt - 1e-9  # infinite if dt is tiny
    if steps > LONGEST:
        raise InputError(
            f"duration {duration:g} s in periods of {dt:g} s are {steps:.3g} steps; "
            "at most 10 million are simulated"
        )
    return max(1, math.ceil(steps))


def _flag(value: Any, what: str) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{what} must be True or False, got {value!r:.80}")
    return bool(value)


def _instance(value: Any, kind: type[T], what: str) -> T:
    """Return a value of this kind; for None the one in which nothing is wrong."""
    made = kind() if value is None else value
    if not isinstance(made, kind):
        raise InputError(f"{what}: expected a robsim.{kind.__name__}, got {value!r:.80}")
    return made
