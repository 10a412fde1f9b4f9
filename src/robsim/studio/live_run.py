"""A run while it goes on, of an experiment that may be changed on its way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.engine.instant import Instant
from robsim.engine.outcome import Outcome
from robsim.plot import run_data
from robsim.run.experiment import Experiment
from robsim.run.simulation_dataset import compute_frame_motion

if TYPE_CHECKING:
    import xarray as xr

MOST = 100_000  # instants that are kept


class LiveRun:
    """The instants of an experiment so far, and what comes next.

    past   instants of what it goes on from, of which the last is where it begins
    forms  a run of one instant, which says what the numbers of an instant are
    piece  the experiment that runs since `since` seconds: from where the past ended

    InputError: the experiment cannot run from there, or is a mission.
    """

    def __init__(self, experiment: Experiment, past: Sequence[Instant] = (), pieces: int = 0):
        start = {"start": past[-1].q} if past else {}
        seed = (experiment.seed + pieces) % 2**64  # so that no noise comes twice
        self.piece = experiment.with_(**start, record="all", seed=seed)
        self._steps, self._pieces = self.piece.steps(), pieces
        self.since = past[-1].time if past else 0.0
        first = next(self._steps)
        self.forms = run_data.extract_single_run(self.piece.run(duration=self.piece.dt)).isel(
            time=[0]
        )
        self.experiment = experiment
        self.instants = [*past[:-1], replace(first, time=self.since)]
        self.fresh = not past  # whether no instant of before is of use

    @property
    def now(self) -> Instant:
        """The last instant."""
        return self.instants[-1]

    @property
    def end(self) -> Instant | None:
        """The instant at which the run ended, if it has."""
        if self.now.outcome == Outcome.RUNNING:
            return None
        return next(each for each in self.instants if each.outcome != Outcome.RUNNING)

    @property
    def full(self) -> bool:
        """Whether no more instants are kept."""
        return len(self.instants) >= MOST

    @property
    def ended(self) -> bool:
        """Whether there is nothing more to come."""
        return self.now.outcome != Outcome.RUNNING or self.full

    def step(self) -> None:
        """Take the next instant; where the run has ended, all stands still while time goes on."""
        if not self.ended:
            instant = next(self._steps)
            self.instants.append(replace(instant, time=self.since + instant.time))
            return
        now, still = self.now, 0.0 * self.now.qd
        later = now.time + self.piece.dt
        self.instants.append(replace(now, time=later, qd=still, qd_actual=still))

    def changed(self, experiment: Experiment) -> LiveRun:
        """Return what goes on from here as a run of another experiment.

        Filters, lags and late images begin anew. Past instants are kept where they have the same
        numbers. InputError: it cannot run from here.
        """
        made = LiveRun(experiment, self.instants, self._pieces + 1)
        if _list_table_columns(made.forms) != _list_table_columns(self.forms):
            made.forget()
        return made

    def forget(self) -> None:
        """Keep no instant but the last one."""
        del self.instants[:-1]
        self.fresh = True

    def table(self, start: int = 0) -> xr.Dataset:
        """Return the instants from a number on, as a run has them."""
        forms, instants = self.forms, self.instants[start:]
        whose = "camera" if "camera_velocity" in forms else "frame"
        parts = ("q", "qd", "error", "pixels", "qd_actual")
        values = {name: np.stack([getattr(each, name) for each in instants]) for name in parts}
        q, rates = values["q"], values["qd_actual"]
        frame = forms[f"{whose}_velocity"].attrs["frame"]
        _, twists = compute_frame_motion(self.experiment.scene, frame, q[None], rates[None])
        values["error_norm"] = np.linalg.norm(values["error"], axis=1)
        values[f"{whose}_velocity"] = twists[0]
        many = forms.isel(time=np.zeros(len(instants), dtype=int))
        many = many.assign({n: (many[n].dims, x) for n, x in values.items() if n in forms})
        return many.assign_coords(time=("time", np.array([each.time for each in instants])))


def _list_table_columns(forms: xr.Dataset) -> Any:
    """Return what tells whether instants of two experiments stand in one table."""
    names = ("coordinate", "velocity", "feature_unit", "mark_camera", "mark_target")
    return [forms[name].values.tolist() for name in names]
