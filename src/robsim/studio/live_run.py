"""A run in progress of an experiment, which can be changed during the run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robsim.analysis.explanation.goal_motion import ALIGNED, NEAR, split_goal_motion
from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.engine.chunk import Chunk
from robsim.engine.instant import Instant, make_instant
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.geometry.pose import Pose, homogeneous_matrix
from robsim.plot.run_pictures import CameraInstants
from robsim.run.end_variables import measure_goal_offset, select_goal_controller
from robsim.run.experiment import Experiment
from robsim.run.frame_motion import compute_frame_motion
from robsim.run.simulation_dataset import make_plain_variables
from robsim.servo.constraints.constraint_stages import BoundConstraints

if TYPE_CHECKING:
    from robsim.plot.run_data import RunVariables

TORQUES = "torque", "saturation"  # parts of an instant with a number for each velocity
ROWS = "active", "slack"  # parts of an instant with a number for each row of constraints
REST = 1.0  # seconds from convergence until a run rests


class LiveRun:
    """The recorded instants of an experiment, and the simulation that continues them.

    A run goes on after convergence for `REST` seconds, or for its duration if a motion is
    prescribed, and then rests: it has no more instants until it is continued by `continue_with`. A
    failure or the time limit ends it. After convergence the failures of a run with `hold` count, so
    that a failure is an outcome of its segment too.

    If `past` are the instants of another run, the run continues from the last of them, or from
    the coordinates `q` (nq,) at its time. Raise InputError if the experiment cannot run from there,
    or is a mission.

    Attributes
    ----------
    segment : Experiment
        The experiment that has been running since `start_time` seconds, from the last past instant.
        Its run ends as this run; it has `hold` if this run failed after convergence.
    template : mapping of str to xarray.Variable
        The variables of a run with one instant.
    decision : Instant or None
        The instant of convergence, or of a later failure; None before.
    restarted : bool
        Whether the past instants were deleted.
    """

    def __init__(
        self,
        experiment: Experiment,
        past: Sequence[Instant] = (),
        segments: int = 0,
        q: Array | None = None,
    ) -> None:
        if not past:
            self.segment = experiment.with_(record="all")
        else:  # each segment has different noise
            seed = (experiment.seed + segments) % 2**64
            start = past[-1].q if q is None else q
            self.segment = experiment.with_(start=start, record="all", seed=seed)
        if self.segment.runs > 1 or self.segment.varied:
            raise InputError("a single run can be shown, and there are several: take of_run(i)")
        self._start_loop(self.segment)
        self.start_time = past[-1].time if past else 0.0
        self._segments, self.experiment = segments, experiment
        self.instants: list[Instant] = list(past[:-1])
        self.decision: Instant | None = None
        self._holds = False
        self._measured: tuple[Instant | None, tuple[Array, Array, Array] | None] = None, None
        self.template = _make_template(self._loop, self._advance())
        self.restarted = not past  # changed by `forget`
        self._holds = bool(past) and self.decision is not None and not self.failed
        if self._holds:
            del self.instants[-1]
            self._start_loop(self.segment.with_(hold=True))
            self._advance()

    @property
    def _leaves_goal(self) -> bool:
        """Whether an error has grown above the tolerance since the run converged."""
        weight = self._loop.controller.tolerances
        return bool(self._holds and (np.abs(self.now.error) > weight).any())

    def _start_loop(self, experiment: Experiment) -> None:
        """Prepare the simulation of an experiment from its start."""
        self._loop = experiment.loop_from_start()
        self._steps = self._loop.instants(np.arange(1), past_convergence=True)

    @property
    def now(self) -> Instant:
        """The last instant."""
        return self.instants[-1]

    @property
    def is_at_start(self) -> bool:
        """Whether the run has not advanced since its start."""
        return self.start_time == 0.0 and self.now.time == 0.0

    @property
    def failed(self) -> bool:
        """Whether a failure or the time limit has ended the run."""
        return self.decision is not None and self.decision.outcome != Outcome.CONVERGED

    @property
    def failed_at_once(self) -> bool:
        """Whether the run ended at the instant of the last change."""
        return self.failed and self.decision is not None and self.decision.time == self.start_time

    @property
    def stands_still(self) -> bool:
        """Whether the run has ended at a configuration from which it can continue."""
        standing = (Outcome.LOCAL_MINIMUM, Outcome.TIME_LIMIT)
        return self.decision is not None and self.decision.outcome in standing

    @property
    def rests(self) -> bool:
        """Whether the run has converged and has no more instants until it is continued."""
        if self.decision is None or self.failed:
            return False
        waited = self.now.time >= self.decision.time + REST - 1e-9
        moves = self.segment.scene.motions or self._leaves_goal
        return self._over or bool(waited and not moves)

    @property
    def idle(self) -> bool:
        """Whether the run has ended or rests."""
        return self.failed or self.rests

    def step(self) -> None:
        """Store the next instant; of an idle run, store instants without motion."""
        if not self.idle:
            self._advance()
            return
        now, still = self.now, 0.0 * self.now.qd
        later = now.time + self.segment.dt
        free = 0.0 * now.active
        rest = replace(now, qd=still, qd_actual=still, saturation=0.0 * now.saturation)
        self.instants.append(replace(rest, time=later, active=free, slack=free))

    def _advance(self) -> Chunk:
        """Simulate the next instant, store it, and return the chunk of the simulation."""
        step, chunk = next(self._steps)
        self._over = step >= self._loop.steps
        instant = make_instant(self._loop, step, chunk)
        instant = replace(instant, time=self.start_time + instant.time)
        self.instants.append(instant)
        if self._is_late_failure(instant):
            self._decide_late_failure(instant, step)
        elif self.decision is None and instant.outcome != Outcome.RUNNING:
            self.decision = instant
        return chunk

    def _is_late_failure(self, instant: Instant) -> bool:
        """Return whether an instant after convergence has the outcome of a failure."""
        harmless = (Outcome.RUNNING, Outcome.CONVERGED, Outcome.TIME_LIMIT)
        return self.decision is not None and instant.outcome not in harmless

    def _decide_late_failure(self, instant: Instant, step: int) -> None:
        """Store a failure after convergence, unless a run with `hold` goes on at this step."""
        holds = self._holds or self.segment.hold
        self.segment = self.segment.with_(hold=True)
        if not holds:
            self._holds = True
            self._start_loop(self.segment)
            chunk = next(chunk for number, chunk in self._steps if number == step)
            instant = replace(make_instant(self._loop, step, chunk), time=instant.time)
            self.instants[-1] = instant
        if self._is_late_failure(instant):
            self.decision = instant

    @property
    def columns(self) -> list[object]:
        """The coordinates, velocities, driven joints, features and feature points of the instants.

        Two runs with equal columns can be joined.
        """
        scene, controller = self.segment.scene, self._loop.controller
        points = [(sight.key, len(sight.target.marks)) for sight in controller.sights]
        driven = self._loop.driven
        joints = () if driven is None else driven.names
        names = [scene.coordinate_names, scene.velocity_names, joints]
        return [*names, tuple(controller.units), points]

    def continue_with(self, experiment: Experiment, q: Array | None = None) -> LiveRun:
        """Return a run of another experiment that continues this one, from q (nq,) if it is passed.

        Filters, lags and image delays start anew. The past instants are kept if both runs have the
        same variables. Raise InputError if the experiment cannot run from here.
        """
        live = LiveRun(experiment, self.instants, self._segments + 1, q)
        if live.columns != self.columns:
            live.forget()
        elif live.constraint_labels != self.constraint_labels:
            before = self.instants[: len(self.instants) - 1]
            live.instants[: len(before)] = _relabel_constraints(
                before, self.constraint_labels, live.constraint_labels
            )
        return live

    def start_again(self, experiment: Experiment) -> LiveRun:
        """Return a run of another experiment from its start, in place of a run at its start."""
        live = LiveRun(experiment)
        live.restarted = live.columns != self.columns
        return live

    def forget(self, kept: int = 1) -> None:
        """Delete all instants but the last ones."""
        del self.instants[:-kept]
        self.restarted = True

    @property
    def constraint_labels(self) -> tuple[str, ...]:
        """Names of the constraints of the law."""
        return self._loop.controller.constraint_labels

    @property
    def constraint_owners(self) -> list[list[str]]:
        """Dotted names of the constraints that make each row of constraints."""
        bound = getattr(self._loop.controller, "constraints", None)
        rows = bound.owners if isinstance(bound, BoundConstraints) else ()
        return [[f"task.law.constraints.{i}" for i in own] for own in rows]

    @property
    def moving_frame(self) -> str:
        """The frame whose goal pose is known: a camera, a target, or the controlled frame."""
        return select_goal_controller(self._loop.controller).moving

    def find_goal_pose(self) -> Pose | None:
        """Return the present goal pose of the moving frame in the world; None if it is unknown."""
        goal, away, _ = self._measure_goal()
        return Pose(homogeneous_matrix(goal)[0]) if np.isfinite(away[0]) else None

    def find_goal_poses(self) -> dict[str, Pose]:
        """Return the present goal pose by the name of the moving frame; empty if it is unknown."""
        pose = self.find_goal_pose()
        return {} if pose is None else {self.moving_frame: pose}

    def measure_distance(self) -> tuple[float, float]:
        """Return the distance (m) and angle (rad) of the moving frame to its goal, or NaN."""
        _, away, turn = self._measure_goal()
        return float(away[0]), float(turn[0])

    def _measure_goal(self) -> tuple[Array, Array, Array]:
        """Return the present goal pose (3, 4, 1), and the distance and angle to it (1,)."""
        instant, measured = self._measured
        if measured is None or instant is not self.now:
            q, start = self.now.q[:, None], self.segment.start
            q0 = self.segment.scene.home if start is None else start
            measured = measure_goal_offset(self._loop.controller, q, np.atleast_2d(q0))
            self._measured = self.now, measured
        return measured

    def variables(self, start: int = 0) -> RunVariables:
        """Return the variables of a run with the instants from number `start` on."""
        import xarray as xr

        template, instants = self.template, self.instants[start:]
        owner = "camera" if "camera_velocity" in template else "frame"
        parts = ("q", "qd", "error", "pixels", "qd_actual", *ROWS, *TORQUES)
        values = {name: np.stack([getattr(each, name) for each in instants]) for name in parts}
        q, rates = values["q"], values["qd_actual"]
        frame = template[f"{owner}_velocity"].attrs["frame"]
        _, twists = compute_frame_motion(self.experiment.scene, frame, q[None], rates[None])
        values["error_norm"] = np.linalg.norm(values["error"], axis=1)
        values[f"{owner}_velocity"] = twists[0]
        values["time"] = np.array([each.time for each in instants])
        return {
            name: xr.Variable(variable.dims, values[name], variable.attrs)
            if name in values
            else variable
            for name, variable in template.items()
            if name in values or "time" not in variable.dims
        }

    def camera_instants(self, start: int = 0, end: int | None = None) -> CameraInstants:
        """Return the coordinates of the instants from number `start` to before `end`."""
        instants, segment = self.instants[start:end], self.segment
        q, time = (np.stack([getattr(each, name) for each in instants]) for name in ("q", "time"))
        return CameraInstants(q, time, segment.seed, segment.first_run, segment.dt, self.start_time)

    @property
    def gain(self) -> float:
        """The decay rate of a small error, in 1/s; the lowest of several tasks."""
        adaptive = getattr(self.segment.task, "gain", None)
        return float(getattr(adaptive, "at_zero", np.min(self._loop.controller.pace)))

    def list_return_obstacles(self) -> list[str]:
        """Return clauses on the parts of the way to the goal that the task does not make."""
        motion = split_goal_motion(self._loop.controller, self.now.q[:, None])
        return list(motion.clauses()) if motion else []

    def predict_return(self) -> float:
        """Return the seconds in which an error that decays by the gain becomes negligible.

        The bounds are `NEAR` and `ALIGNED`. 0 if the goal pose is not known.
        """
        length, angle = self.measure_distance()
        ratio = float(np.nanmax([length / NEAR, angle / ALIGNED, 1.0]))
        return math.log(ratio) / self.gain if self.gain > 0.0 else 0.0


def _relabel_constraints(
    instants: Sequence[Instant], before: Sequence[str], after: Sequence[str]
) -> list[Instant]:
    """Return instants with the rows of other constraints; a row that they lack is free."""
    known = {name: i for i, name in enumerate(before)}
    own = np.array([known.get(name, len(known)) for name in after], dtype=int)
    return [
        replace(each, **{name: np.append(getattr(each, name), 0.0)[own] for name in ROWS})
        for each in instants
    ]


def _make_template(loop: Loop, chunk: Chunk) -> RunVariables:
    """Return the variables of a run of one instant, the first of a loop."""
    short, sequence = replace(loop, steps=0, record="all"), loop.sequence
    recorder = short.recorder
    recorder.stop(chunk, 0, sequence.end_rows)
    recorder.table[:, 0] = recorder.ends[:, : recorder.table.shape[-1]]
    return make_plain_variables(short, loop.scene)
