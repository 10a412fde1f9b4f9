"""A run in progress of an experiment, which can be changed during the run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.engine.instant import Instant, iterate_instants
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.run.end_variables import measure_goal_offset, select_goal_controller
from robsim.run.experiment import Experiment
from robsim.run.simulation_dataset import compute_frame_motion, make_dataset

if TYPE_CHECKING:
    import xarray as xr

MOST = 100_000  # largest number of stored instants
NEAR, ALIGNED = 1e-3, math.radians(0.1)  # metres and radians from the goal that are negligible
REST = 1.0  # seconds from convergence until a run rests


class LiveRun:
    """The recorded instants of an experiment, and the simulation that continues them.

    A run goes on after convergence for `REST` seconds, or for its duration if a motion is
    prescribed, and then rests: it has no more instants until it is continued by `continue_with`. A
    failure or the time limit ends it.

    If `past` are the instants of another run, the run continues from the last of them, or from
    the coordinates `q` (nq,) at its time. Raise InputError if the experiment cannot run from there,
    or is a mission.

    Attributes
    ----------
    segment : Experiment
        The experiment that has been running since `start_time` seconds, from the last past instant.
    template : xarray.Dataset
        A run with one instant, which has the variables of all instants.
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
        loop = self.segment.loop_from_start()
        self.controller, self._last_step, self._segments = loop.controller, loop.steps, segments
        self._steps = iterate_instants(loop, past_convergence=True)
        self.start_time = past[-1].time if past else 0.0
        self.template = _make_template(loop, self.segment)
        self.experiment = experiment
        self.instants, self.decision = list(past[:-1]), None
        self._store(next(self._steps))
        self.restarted = not past  # changed by `forget`

    @property
    def now(self) -> Instant:
        """The last instant."""
        return self.instants[-1]

    @property
    def is_at_start(self) -> bool:
        """Whether the run has not advanced since its start."""
        return self.start_time == 0.0 and self.now.time == 0.0

    @property
    def full(self) -> bool:
        """Whether the largest number of instants is stored."""
        return len(self.instants) >= MOST

    @property
    def failed(self) -> bool:
        """Whether the run has ended otherwise than by convergence."""
        return self.decision is not None and self.decision.outcome != Outcome.CONVERGED

    @property
    def failed_at_once(self) -> bool:
        """Whether the run ended at the instant of the last change."""
        return self.failed and self.decision is not None and self.decision.time == self.start_time

    @property
    def rests(self) -> bool:
        """Whether the run has converged and has no more instants until it is continued."""
        if self.decision is None or self.failed:
            return False
        waited = self.now.time >= self.decision.time + REST - 1e-9
        return self._over or (waited and not self.segment.scene.motions)

    @property
    def ended(self) -> bool:
        """Whether a failure, the time limit or the number of stored instants has ended the run."""
        return self.failed or self.full

    @property
    def idle(self) -> bool:
        """Whether the run has ended or rests."""
        return self.ended or self.rests

    def step(self) -> None:
        """Store the next instant; of an idle run, store instants without motion."""
        if not self.idle:
            self._store(next(self._steps))
            return
        now, still = self.now, 0.0 * self.now.qd
        later = now.time + self.segment.dt
        self.instants.append(replace(now, time=later, qd=still, qd_actual=still))

    def _store(self, instant: Instant) -> None:
        """Store an instant of the simulation, and the decision about its outcome."""
        self._over = instant.step >= self._last_step
        instant = replace(instant, time=self.start_time + instant.time)
        self.instants.append(instant)
        outcome = instant.outcome
        late = self.decision is not None and outcome in (Outcome.CONVERGED, Outcome.TIME_LIMIT)
        if outcome != Outcome.RUNNING and not late:
            self.decision = instant

    def continue_with(self, experiment: Experiment, q: Array | None = None) -> LiveRun:
        """Return a run of another experiment that continues this one, from q (nq,) if it is passed.

        Filters, lags and image delays start anew. The past instants are kept if both runs have the
        same variables. Raise InputError if the experiment cannot run from here.
        """
        live = LiveRun(experiment, self.instants, self._segments + 1, q)
        if _list_table_columns(live.template) != _list_table_columns(self.template):
            live.forget()
        return live

    def start_again(self, experiment: Experiment) -> LiveRun:
        """Return a run of another experiment from its start, in place of a run at its start."""
        live = LiveRun(experiment)
        live.restarted = _list_table_columns(live.template) != _list_table_columns(self.template)
        return live

    def forget(self) -> None:
        """Keep only the last instant."""
        del self.instants[:-1]
        self.restarted = True

    def measure_distance(self) -> tuple[float, float, str]:
        """Return the distance (m) and angle (rad) of the moving frame to its goal, and its name.

        The numbers are NaN if the goal pose is not known.
        """
        q, start = self.now.q[:, None], self.segment.start
        q0 = self.segment.scene.home if start is None else start
        _, away, turn = measure_goal_offset(self.controller, q, np.atleast_2d(q0))
        return float(away[0]), float(turn[0]), select_goal_controller(self.controller).moving

    def table(self, start: int = 0) -> xr.Dataset:
        """Return the instants from number `start` on as a run."""
        import xarray as xr

        template, instants = self.template, self.instants[start:]
        owner = "camera" if "camera_velocity" in template else "frame"
        parts = ("q", "qd", "error", "pixels", "qd_actual")
        values = {name: np.stack([getattr(each, name) for each in instants]) for name in parts}
        q, rates = values["q"], values["qd_actual"]
        frame = template[f"{owner}_velocity"].attrs["frame"]
        _, twists = compute_frame_motion(self.experiment.scene, frame, q[None], rates[None])
        values["error_norm"] = np.linalg.norm(values["error"], axis=1)
        values[f"{owner}_velocity"] = twists[0]
        values["time"] = np.array([each.time for each in instants])
        every = {
            name: xr.Variable(variable.dims, values[name], variable.attrs) if name in values else variable
            for name, variable in template.variables.items()
            if name in values or "time" not in variable.dims
        }
        coords = {name: every.pop(name) for name in template.coords if name in every}
        return xr.Dataset(every, coords, template.attrs)

    @property
    def gain(self) -> float:
        """The decay rate of a small error, in 1/s; the lowest of several tasks."""
        adaptive = getattr(self.segment.task, "gain", None)
        return float(getattr(adaptive, "at_zero", np.min(self.controller.pace)))

    def predict_return(self) -> float:
        """Return the seconds in which an error that decays by the gain becomes negligible.

        The bounds are `NEAR` and `ALIGNED`. 0 if the goal pose is not known.
        """
        length, angle, _ = self.measure_distance()
        ratio = float(np.nanmax([length / NEAR, angle / ALIGNED, 1.0]))
        return math.log(ratio) / self.gain if self.gain > 0.0 else 0.0


def _make_template(loop: Loop, segment: Experiment) -> xr.Dataset:
    """Return a run of one instant, without the text of its experiment."""
    short = replace(loop, steps=0, record="all")
    for _ in iterate_instants(short):
        pass
    return make_dataset(short, segment, dict)


def _list_table_columns(template: xr.Dataset) -> list[list[str]]:
    """Return the coordinates that must be equal in two runs to join their instants."""
    names = ("coordinate", "velocity", "feature_unit", "mark_camera", "mark_target")
    return [template[name].values.tolist() for name in names]
