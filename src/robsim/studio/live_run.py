"""A run in progress of an experiment, which can be changed during the run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robsim.engine.instant import Instant
from robsim.engine.outcome import Outcome
from robsim.plot import run_data
from robsim.run.experiment import Experiment
from robsim.run.simulation_dataset import compute_frame_motion

if TYPE_CHECKING:
    import xarray as xr

MOST = 100_000  # largest number of stored instants


class LiveRun:
    """The recorded instants of an experiment, and the simulation that continues them.

    If `past` are the instants of another run, the run continues from the last of them. Raise
    InputError if the experiment cannot run from there, or is a mission.

    Attributes
    ----------
    segment : Experiment
        The experiment that has been running since `start_time` seconds, from the last past instant.
    template : xarray.Dataset
        A run with one instant, which has the variables of all instants.
    restarted : bool
        Whether the past instants were deleted.
    """

    def __init__(self, experiment: Experiment, past: Sequence[Instant] = (), segments: int = 0):
        start = {"start": past[-1].q} if past else {}
        seed = (experiment.seed + segments) % 2**64  # each segment has different noise
        self.segment = experiment.with_(**start, record="all", seed=seed)
        self._steps, self._segments = self.segment.steps(), segments
        self.start_time = past[-1].time if past else 0.0
        first = next(self._steps)
        self.template = run_data.extract_single_run(
            self.segment.run(duration=self.segment.dt)
        ).isel(time=[0])
        self.experiment = experiment
        self.instants = [*past[:-1], replace(first, time=self.start_time)]
        self.restarted = not past  # changed by `forget`

    @property
    def now(self) -> Instant:
        """The last instant."""
        return self.instants[-1]

    @property
    def end(self) -> Instant | None:
        """The first instant with an outcome; None while the run goes on."""
        if self.now.outcome == Outcome.RUNNING:
            return None
        return next(each for each in self.instants if each.outcome != Outcome.RUNNING)

    @property
    def full(self) -> bool:
        """Whether the largest number of instants is stored."""
        return len(self.instants) >= MOST

    @property
    def ended(self) -> bool:
        """Whether the run has no more instants."""
        return self.now.outcome != Outcome.RUNNING or self.full

    def step(self) -> None:
        """Store the next instant; after the end, store instants without motion."""
        if not self.ended:
            instant = next(self._steps)
            self.instants.append(replace(instant, time=self.start_time + instant.time))
            return
        now, still = self.now, 0.0 * self.now.qd
        later = now.time + self.segment.dt
        self.instants.append(replace(now, time=later, qd=still, qd_actual=still))

    def continue_with(self, experiment: Experiment) -> LiveRun:
        """Return a run of another experiment that continues this one.

        Filters, lags and image delays start anew. The past instants are kept if both runs have the
        same variables. Raise InputError if the experiment cannot run from here.
        """
        live = LiveRun(experiment, self.instants, self._segments + 1)
        if _list_table_columns(live.template) != _list_table_columns(self.template):
            live.forget()
        return live

    def forget(self) -> None:
        """Keep only the last instant."""
        del self.instants[:-1]
        self.restarted = True

    def table(self, start: int = 0) -> xr.Dataset:
        """Return the instants from number `start` on as a run."""
        template, instants = self.template, self.instants[start:]
        owner = "camera" if "camera_velocity" in template else "frame"
        parts = ("q", "qd", "error", "pixels", "qd_actual")
        values = {name: np.stack([getattr(each, name) for each in instants]) for name in parts}
        q, rates = values["q"], values["qd_actual"]
        frame = template[f"{owner}_velocity"].attrs["frame"]
        _, twists = compute_frame_motion(self.experiment.scene, frame, q[None], rates[None])
        values["error_norm"] = np.linalg.norm(values["error"], axis=1)
        values[f"{owner}_velocity"] = twists[0]
        many = template.isel(time=np.zeros(len(instants), dtype=int))
        many = many.assign({n: (many[n].dims, x) for n, x in values.items() if n in template})
        return many.assign_coords(time=("time", np.array([each.time for each in instants])))


def _list_table_columns(template: xr.Dataset) -> list[list[str]]:
    """Return the coordinates that must be equal in two runs to join their instants."""
    names = ("coordinate", "velocity", "feature_unit", "mark_camera", "mark_target")
    return [template[name].values.tolist() for name in names]
