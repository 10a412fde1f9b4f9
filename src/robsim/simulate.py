"""The one loop: every run of every servo scheme goes through here."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.arrays import Array, numbers, positive, runs_last
from robsim.errors import InputError, Interrupted
from robsim.interrupt import undisturbed
from robsim.kernels import loop as kernels
from robsim.kernels import tree
from robsim.kernels.endings import Watch
from robsim.kernels.jit import is_cold
from robsim.kernels.loop import Command, Noise
from robsim.outcome import Outcome
from robsim.record import LONGEST, Record, Recorder
from robsim.robot import LIMIT_SLACK
from robsim.scene import Scene
from robsim.servo.controller import Controller
from robsim.servo.instant import Instant
from robsim.servo.inverse import rank
from robsim.servo.sight import joined
from robsim.servo.task import Task

if TYPE_CHECKING:
    import xarray as xr

WORTH_COMPILING = 1000  # steps of runs; compiling the whole loop for fewer costs more than it saves
BURST = 100_000  # steps of runs that go on in compiled code before Ctrl-C is looked for
Progress = Callable[[float], None]


def simulate(
    scene: Scene,
    task: Task,
    q0: Any = None,
    *,
    dt: float = 0.04,
    duration: float = 10.0,
    seed: int = 0,
    noise: float = 0.0,
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
    noise       standard deviation of the measured pixels, keyed by (seed, run) and step
    hold        go on to the end of the duration, also after convergence: to follow what moves
    record      "all", every n-th step, or "summary": the end of each run
    run         number of the first run, to repeat one row of a batch alone with its noise
    threads     how many; None for one per processor. The result is the same for any number
    chunk       how many runs go in lockstep at most; the result is the same for any number
    progress    called now and then with the share that is done, 0 to 1

    After its end a run is NaN. InputError before anything runs; Interrupted after Ctrl-C.

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> run = simulate(scenario.scene, scenario.task, scenario.q0, duration=25)
    >>> rs.Outcome(int(run.outcome)).name, round(float(run.error_norm[149]), 4)
    ('CONVERGED', 0.023)
    """
    from robsim.results import dataset

    _check_kinds(scene, task, progress)
    controller = task.bind(scene)
    starts = scene.coordinates(scene.home if q0 is None else q0, "q0")
    if starts.ndim > 2 or starts.size == 0:
        raise InputError(f"q0: expected shape ({scene.nq},) or (B, {scene.nq}), got {starts.shape}")
    dt, duration = positive(dt, "dt (seconds)"), positive(duration, "duration (seconds)")
    chunk = _whole(chunk, "chunk", 1)
    threads = _whole(_processors() if threads is None else threads, "threads", 1, 1025)
    loop = Loop(
        controller,
        np.ascontiguousarray(starts.reshape(-1, scene.nq)),
        dt,
        _whole_periods(dt, duration),
        _whole(seed, "seed", 0, 2**64),
        _noise(noise),
        _flag(hold, "hold"),
        _whole(run, "run", 0, 2**62),
        record,
    )
    finished = _work(loop, threads, chunk, progress)
    with undisturbed() as stops:
        result = dataset(loop, scene, task, single=starts.ndim == 1)
    if stops or not finished:
        raise Interrupted("stopped by the user; what was simulated so far is in .run", result)
    return result


def pays(runs: int, steps: float) -> bool:
    """Whether to take the compiled loop, which gives the same bits: it is there, or worth it."""
    there = getattr(kernels.stride, "signatures", ()) or not is_cold("loop.stride")
    return bool(there) or runs * steps >= WORTH_COMPILING


@dataclass
class Loop:
    """What all chunks share: constants, the record, and whether to stop."""

    controller: Controller
    q0: Array  # (runs, nq)
    dt: float
    steps: int
    seed: int
    noise: float
    hold: bool
    first_run: int
    record: Record
    stopped: bool = field(default=False, init=False)
    recorder: Recorder = field(init=False)

    def __post_init__(self) -> None:
        controller, scene = self.controller, self.scene
        widths = (scene.nq, scene.nv, controller.k, controller.goal_pixels.size)
        self.recorder = Recorder(len(self.q0), self.steps, self.record, widths)
        slack = np.array([-LIMIT_SLACK, LIMIT_SLACK])
        self.limits = np.ascontiguousarray(scene.limits + slack)
        self.steady = not any(callable(motion.rates) for motion in scene.motions)
        self.still = scene.drift(0.0)
        ends = np.cumsum([0, *(len(sight.target.marks) for sight in controller.sights)])
        self.rows = [slice(*pair) for pair in pairwise(ends.tolist())]  # of pixels, by sight
        scheme = controller.compiled if self.steady else None
        self.scheme = scheme if scheme and pays(len(self.q0), self.steps) else None

    @property
    def scene(self) -> Scene:
        """The true one."""
        scene: Scene = self.controller.scene
        return scene

    def advance(self, rows: NDArray[np.int64], done: Callable[[float], None]) -> None:
        """Take a chunk of runs from their starts to their ends, in lockstep."""
        step, chunk = 0, _Chunk.start(self, rows)
        go_on = _stride if self.scheme else _step
        joints = self.scene.tree.joints
        while not self.stopped or step:  # a chunk that has begun is left at a recorded instant
            step, now = go_on(self, chunk, step)
            over, qd = (now.outcome > 0) | self.stopped, now.qd
            if over.any():
                _tell_singular(self.controller, now)
                self.recorder.end(step, chunk.rows, now, chunk.watch.length, over)
                chunk, qd = chunk.without(over), _keep(now.qd, ~over)
            if not chunk.rows.size:
                break
            tree.integrate(joints.kind, joints.iq, joints.iv, qd, self.dt, chunk.q)
            step += 1
            done(step / (self.steps + 1))
        done(1.0)


class Now(NamedTuple):
    """The instant at which a chunk stands: coordinates, all velocities, and what was seen."""

    q: Array  # (nq, B)
    qd: Array  # (nv, B)
    pixels: Array  # (N, 2, B) of all sights, without noise
    command: Command
    outcome: NDArray[np.int8]


@dataclass
class _Chunk:
    """The runs of a chunk that go on."""

    rows: NDArray[np.int64]
    q: Array
    noise: Noise
    watch: Watch
    memory: dict[str, Any]  # of the controller, run first

    @classmethod
    def start(cls, loop: Loop, rows: NDArray[np.int64]) -> _Chunk:
        """The chunk at its start; `endings.begin` fills the watch."""
        runs = rows.size
        still, before = np.empty(runs, dtype=np.int64), np.empty((3, runs))
        watch = Watch(np.empty(runs), np.empty(runs), still, before, np.empty(runs))
        number = (rows + loop.first_run).astype(np.uint64)
        noise = Noise(loop.noise, np.uint64(loop.seed), number)
        return cls(rows, runs_last(loop.q0[rows], 1), noise, watch, {})

    def without(self, over: NDArray[np.bool_]) -> _Chunk:
        """The chunk that goes on when some runs are over."""
        noise = self.noise._replace(runs=self.noise.runs[~over])
        watch = Watch(*(_keep(array, ~over) for array in self.watch))
        memory = _remembered(self.memory, ~over)
        return _Chunk(self.rows[~over], _keep(self.q, ~over), noise, watch, memory)


def _stride(loop: Loop, chunk: _Chunk, step: int) -> tuple[int, Now]:
    """With a built-in scheme: many steps in compiled code, until a run ends or a while is over."""
    controller, recorder, runs = loop.controller, loop.recorder, chunk.rows.size
    k, n, nv = controller.k, controller.columns.size, loop.scene.nv
    sight = controller.sights[0]
    command = Command(
        np.empty((k, runs)), np.empty((k, runs)), np.empty((n, runs)), np.empty((k, n, runs))
    )
    look, qd, outcome = sight.room(runs), np.empty((nv, runs)), np.empty(runs, np.int8)
    step = kernels.stride(
        step,
        min(step + max(BURST // runs, 1), loop.steps),
        loop.steps,
        loop.dt,
        loop.scene.tree.joints,
        loop.limits,
        loop.hold,
        loop.still,
        sight.constants,
        sight.moves(controller.columns),
        loop.scheme,
        chunk.noise,
        chunk.watch,
        chunk.rows,
        recorder.every or 0,
        recorder.series,
        chunk.q,
        look,
        command,
        qd,
        outcome,
    )
    return step, Now(chunk.q, qd, look.pixels, command, outcome)


def _step(loop: Loop, chunk: _Chunk, step: int) -> tuple[int, Now]:
    """With anybody's feature, law or belief: one step, the same sequence as in `kernels.stride`."""
    controller, runs = loop.controller, chunk.rows.size
    sights = controller.sights
    looks = [sight.look(chunk.q) for sight in sights]
    look = joined(looks)
    pixels = np.empty_like(look.pixels)
    kernels.measure(look.pixels, chunk.noise, step, pixels)
    seen = {sight.key: each for sight, each in zip(sights, looks, strict=True)}
    measured = {sight.key: pixels[rows] for sight, rows in zip(sights, loop.rows, strict=True)}
    now = Instant(step, loop.dt, chunk.q, seen, measured, chunk.memory)
    command = controller.control(now)
    T = looks[0].T_w_c if sights[0].constants.moves else looks[0].T_w_o
    qd, outcome = np.empty((loop.scene.nv, runs)), np.empty(runs, dtype=np.int8)
    kernels.settle(
        step,
        loop.steps,
        loop.limits,
        loop.hold,
        loop.still if loop.steady else loop.scene.drift(step * loop.dt),
        controller.columns,
        controller.pace,
        controller.tolerance,
        chunk.watch,
        chunk.rows,
        loop.recorder.every or 0,
        loop.recorder.series,
        chunk.q,
        look,
        T,
        command,
        qd,
        outcome,
    )
    return step, Now(chunk.q, qd, look.pixels, command, outcome)


def _remembered(memory: dict[str, Any], going: NDArray[np.bool_]) -> dict[str, Any]:
    """What a controller or a user's law remembers of the runs that go on."""
    kept: dict[str, Any] = {}
    for name, value in memory.items():
        if isinstance(value, dict):
            kept[name] = _remembered(value, going)
        else:
            kept[name] = _rows(name, value, going.size)[going]
    return kept


def _rows(name: str, value: Any, runs: int) -> NDArray[Any]:
    """An array with a row for each run; InputError if what is remembered is none."""
    try:
        array = np.asarray(value)
    except ValueError:  # rows of unequal lengths
        array = np.empty(())
    if array.shape[:1] != (runs,):
        raise InputError(
            f"memory {name!r}: expected an array with a row for each of {runs} runs, "
            f"got {value!r:.80}"
        )
    return array


def _keep(array: Any, going: NDArray[Any]) -> Any:
    return np.ascontiguousarray(array[..., going])


def _tell_singular(controller: Controller, now: Now) -> None:
    """A stall where L J has lost rank is a singularity, not a local minimum."""
    stalled = np.flatnonzero(now.outcome == Outcome.LOCAL_MINIMUM)
    if stalled.size:
        reach = _keep(now.command.reach, stalled)
        lost = rank(reach, controller.rcond) < controller.full_rank
        now.outcome[stalled[lost]] = Outcome.SINGULAR


def _work(loop: Loop, threads: int, chunk: int, progress: Progress | None) -> bool:
    """Let threads take chunks while this one waits for Ctrl-C; False if it came."""
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


def _check_kinds(scene: object, task: object, progress: object) -> None:
    if not isinstance(scene, Scene):
        raise InputError(f"scene: expected a Scene, got {scene!r:.80}")
    if isinstance(task, type) or not isinstance(task, Task):
        raise InputError(f"task: expected a task such as IBVS(...), got {task!r:.80}")
    if progress is not None and not callable(progress):
        raise InputError(f"progress: expected a function of the share done, got {progress!r:.80}")


def _processors() -> int:
    """Those that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _whole_periods(dt: float, duration: float) -> int:
    if dt > duration:
        raise InputError(f"dt {dt:g} s is longer than the duration {duration:g} s")
    steps = duration / dt - 1e-9  # infinite if dt is tiny
    if steps > LONGEST:
        raise InputError(
            f"duration {duration:g} s in periods of {dt:g} s are {steps:.3g} steps; "
            "at most 10 million are simulated"
        )
    return max(1, math.ceil(steps))


def _whole(value: Any, what: str, low: int, below: int | None = None) -> int:
    number = numbers(value, what, ())
    if isinstance(value, bool) or number.ndim or number != np.round(number) or number < low:
        raise InputError(f"{what} must be a whole number from {low} on, got {value!r}")
    if below is not None and int(value) >= below:
        raise InputError(f"{what} must be below {below}, got {value!r}")
    return int(value)


def _flag(value: Any, what: str) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{what} must be True or False, got {value!r:.80}")
    return bool(value)


def _noise(value: Any) -> float:
    number = numbers(value, "noise (pixels)", ())
    if number.ndim or number < 0:
        raise InputError(f"noise (pixels) must be a number not below 0, got {value!r}")
    return float(number)
