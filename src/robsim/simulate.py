"""The one loop: every run of every servo scheme goes through here."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robsim.arrays import Array, numbers, positive, runs_last
from robsim.errors import InputError, Interrupted
from robsim.kernels import endings, random, tree
from robsim.outcome import Outcome
from robsim.record import Record, Recorder
from robsim.robot import LIMIT_SLACK
from robsim.scene import Scene
from robsim.servo.controller import Command, Controller
from robsim.servo.inverse import rank
from robsim.servo.sight import Look

if TYPE_CHECKING:
    import xarray as xr

    from robsim.servo import IBVS

DIVERGENCE = 100.0  # a run diverges when its error or depth exceeds that of its start so many times
Progress = Callable[[float], None]


def simulate(
    scene: Scene,
    task: IBVS,
    q0: Any = None,
    *,
    dt: float = 0.04,
    duration: float = 10.0,
    seed: int = 0,
    noise: float = 0.0,
    record: Record = "all",
    run: int = 0,
    threads: int | None = None,
    chunk: int = 1024,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Close the loop from q0 and return what happened, as an xarray.Dataset.

    q0          start (nq,), or a batch of them (B, nq); or {robot: q}; None is home
    dt          control period in seconds: a command is held for it, and the motion is exact
    duration    seconds, rounded up to whole periods
    noise       standard deviation of the measured pixels, keyed by (seed, run) and step
    record      "all", every n-th step, or "summary": the end of each run
    run         number of the first run, to repeat one row of a batch alone with its noise
    threads     how many; None for one per processor. The result is the same for any number
    chunk       how many runs go in lockstep at most; the result is the same for any number
    progress    called now and then with the share that is done, 0 to 1

    After its end a run is NaN. InputError before anything runs; Interrupted after Ctrl-C.

    """
    from robsim.results import dataset

    starts = scene.coordinates(scene.home if q0 is None else q0, "q0")
    if starts.ndim > 2 or starts.size == 0:
        raise InputError(f"q0: expected shape ({scene.nq},) or (B, {scene.nq}), got {starts.shape}")
    controller = task.bind(scene)
    loop = Loop(
        controller,
        np.ascontiguousarray(starts.reshape(-1, scene.nq)),
        positive(dt, "dt (seconds)"),
        _whole_periods(dt, positive(duration, "duration (seconds)")),
        _whole(seed, "seed", 0, 2**64),
        _noise(noise),
        _whole(run, "run", 0, 2**64),
        record,
    )
    chunk = _whole(chunk, "chunk", 1)
    threads = _whole(threads or os.cpu_count() or 1, "threads", 1)
    finished = _work(loop, threads, chunk, progress)
    result = dataset(loop, scene, task, single=starts.ndim == 1)
    if not finished:
        raise Interrupted("stopped by the user; what was simulated so far is in .run", result)
    return result


@dataclass
class Loop:
    """What all chunks share: constants, the record, and whether to stop."""

    controller: Controller
    q0: Array  # (runs, nq)
    dt: float
    steps: int
    seed: int
    noise: float
    first_run: int
    record: Record
    stopped: bool = field(default=False, init=False)
    recorder: Recorder = field(init=False)

    def __post_init__(self) -> None:
        controller, scene = self.controller, self.scene
        widths = (scene.nq, scene.nv, controller.k, controller.goal.pixels.size)
        self.recorder = Recorder(len(self.q0), self.steps, self.record, widths)
        self._nv = scene.nv
        slack = np.array([-LIMIT_SLACK, LIMIT_SLACK])
        self.limits = np.ascontiguousarray(scene.limits + slack)

    @property
    def scene(self) -> Scene:
        """The true one."""
        return self.controller.truth.scene

    def advance(self, rows: NDArray[np.int64], done: Callable[[float], None]) -> None:
        """Take a chunk of runs from their starts to their ends, in lockstep."""
        q = runs_last(self.q0[rows], 1)
        watch: _Watch | None = None
        truth, joints = self.controller.truth, self.scene.tree
        for step in range(self.steps + 1):
            if self.stopped:
                return
            look = truth.look(q)
            command = self.controller.control(q, look, self._measured(look.pixels, step, rows))
            watch = watch or _Watch.start(self, look, command)
            outcome = watch.judge(self, step, q, look, command)
            qd = self._all_velocities(command.qd)
            values = (q, qd, command.s, look.pixels.reshape(-1, rows.size))
            self.recorder.moment(step, rows, values)
            if outcome.any():
                over = outcome > 0
                ended = tuple(np.ascontiguousarray(value[:, over]) for value in values)
                self.recorder.end(step, rows[over], ended, outcome[over], watch.length[over])
                rows, q, qd = rows[~over], _keep(q, ~over), _keep(qd, ~over)
                watch = watch.keep(~over)
                if not rows.size:
                    break
            tree.integrate(joints.kind, joints.iq, joints.iv, qd, self.dt, q)
            done((step + 1) / (self.steps + 1))
        done(1.0)

    def _measured(self, pixels: Array, step: int, rows: NDArray[np.int64]) -> Array:
        """Pixels (N, 2, B) with the noise of this step."""
        if self.noise == 0.0:
            return pixels
        normal = np.empty_like(pixels)
        runs = (rows + self.first_run).astype(np.uint64)
        random.normal_pairs(np.uint64(self.seed), runs, step, normal)
        return pixels + self.noise * normal

    def _all_velocities(self, qd: Array) -> Array:
        """(nv, B): the commanded columns, zero for joints that do not take part."""
        if len(qd) == self._nv:
            return qd
        full = np.zeros((self._nv, qd.shape[1]))
        full[self.controller.belief.columns] = qd
        return full


@dataclass
class _Watch:
    """What the ending rules remember of each run of a chunk."""

    norm: Array
    farthest: Array
    still: NDArray[np.int64]
    before: Array  # (3, B) last position of the moving frame
    length: Array

    @classmethod
    def start(cls, loop: Loop, look: Look, command: Command) -> _Watch:
        runs = command.error.shape[1]
        norm, farthest = np.empty(runs), np.empty(runs)
        endings.sizes(command.error, look.depth, norm, farthest)
        norm = DIVERGENCE * np.maximum(norm, DIVERGENCE * loop.controller.tolerance)
        before = _moving(loop, look)[:, 3].copy()
        still = np.zeros(runs, dtype=np.int64)
        return cls(norm, DIVERGENCE * farthest, still, before, np.zeros(runs))

    def judge(
        self, loop: Loop, step: int, q: Array, look: Look, command: Command
    ) -> NDArray[np.int8]:
        """(B,) of `Outcome` at this instant; RUNNING for runs that go on."""
        controller = loop.controller
        outcome = np.empty(self.still.size, dtype=np.int8)
        endings.judge(
            q,
            loop.limits,
            look.visibility,
            look.depth,
            command.error,
            command.qd,
            command.reach,
            controller.gain,
            controller.tolerance,
            _moving(loop, look),
            self.norm,
            self.farthest,
            self.still,
            self.before,
            self.length,
            outcome,
        )
        if outcome.any():
            _tell_singular(controller, command, outcome)
        if step == loop.steps:
            outcome[outcome == Outcome.RUNNING] = Outcome.TIME_LIMIT
        return outcome

    def keep(self, going: NDArray[np.bool_]) -> _Watch:
        every = self.norm, self.farthest, self.still, self.before, self.length
        return _Watch(*(_keep(array, going) for array in every))


def _moving(loop: Loop, look: Look) -> Array:
    return look.T_w_c if loop.controller.truth.camera_moves else look.T_w_o


def _keep(array: Any, going: NDArray[Any]) -> Any:
    return np.ascontiguousarray(array[..., going])


def _tell_singular(controller: Controller, command: Command, outcome: NDArray[np.int8]) -> None:
    """A stall where L J has lost rank is a singularity, not a local minimum."""
    stalled = np.flatnonzero(outcome == Outcome.LOCAL_MINIMUM)
    if stalled.size:
        lost = rank(_keep(command.reach, stalled)) < controller.full_rank
        outcome[stalled[lost]] = Outcome.SINGULAR


def _work(loop: Loop, threads: int, chunk: int, progress: Progress | None) -> bool:
    """Let threads take chunks while this one waits for Ctrl-C; False if it came."""
    chunk = min(chunk, math.ceil(len(loop.q0) / threads))
    chunks = [np.arange(i, min(i + chunk, len(loop.q0))) for i in range(0, len(loop.q0), chunk)]
    shares = np.zeros(len(chunks))
    weights = np.array([len(rows) for rows in chunks]) / len(loop.q0)
    with ThreadPoolExecutor(min(threads, len(chunks))) as pool:
        jobs = [pool.submit(loop.advance, c, _cell(shares, i)) for i, c in enumerate(chunks)]
        try:
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


def _whole_periods(dt: float, duration: float) -> int:
    steps = math.ceil(duration / dt - 1e-9)
    if steps > 10_000_000:
        raise InputError(
            f"duration {duration:g} s in periods of {dt:g} s are {steps} steps; "
            "at most 10 million are simulated"
        )
    return steps


def _whole(value: Any, what: str, low: int, below: int | None = None) -> int:
    number = numbers(value, what, ())
    if isinstance(value, bool) or number.ndim or number != np.round(number) or number < low:
        raise InputError(f"{what} must be a whole number from {low} on, got {value!r}")
    if below is not None and int(value) >= below:
        raise InputError(f"{what} must be below {below}, got {value!r}")
    return int(value)


def _noise(value: Any) -> float:
    number = numbers(value, "noise (pixels)", ())
    if number.ndim or number < 0:
        raise InputError(f"noise (pixels) must be a number not below 0, got {value!r}")
    return float(number)
