"""A run while it goes on, of an experiment that may be changed on its way."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.plot import history
from robsim.run.experiment import Experiment
from robsim.run.instant import Instant
from robsim.run.outcome import Outcome
from robsim.run.result import frame_motion

if TYPE_CHECKING:
    import xarray as xr

MOST = 100_000  # instants that are kept


class Live:
    """The instants of an experiment so far, and what comes next.

    Where the experiment is changed on its way, what follows is a run of the changed one from the
    coordinates that were reached: filters, lags and late images begin anew there.

    InputError: the experiment cannot run, or is a mission.
    """

    def __init__(self, experiment: Experiment) -> None:
        self.instants: list[Instant] = []
        self.forms: xr.Dataset
        self._pieces = 0
        self._begin(experiment, experiment, 0.0)

    @property
    def now(self) -> Instant:
        """The last instant."""
        return self.instants[-1]

    @property
    def ended(self) -> bool:
        """Whether there is nothing more to come."""
        return self.now.outcome != Outcome.RUNNING or len(self.instants) >= MOST

    def step(self) -> None:
        """Take the next instant; the last one once more where the run has ended."""
        if self.ended:
            self.instants.append(replace(self.now, time=self.now.time + self.piece.dt))
        else:
            self._take()

    def change(self, experiment: Experiment) -> bool:
        """Go on as another experiment from here; return whether past instants are of use no more.

        They are not where the numbers of an instant are others: other features, or marks.

        InputError: it cannot run from here, and nothing is changed.
        """
        here = self.now
        before = _widths(self.forms)
        self._begin(experiment, experiment.with_(start=here.q), here.time)
        anew: bool = _widths(self.forms) != before
        self.instants[:] = [*([] if anew else self.instants[:-2]), self.now]
        return anew

    def table(self, start: int = 0) -> xr.Dataset:
        """Return the instants from a number on, as a run has them."""
        return _table(self.forms, self.instants[start:], self.experiment)

    def _begin(self, experiment: Experiment, piece: Experiment, time: float) -> None:
        piece = piece.with_(record="all", seed=(experiment.seed + self._pieces) % 2**64)
        steps = piece.steps()
        first = next(steps)
        self.forms = history.single(piece.run(duration=piece.dt)).isel(time=[0])
        self.experiment, self.piece, self._since, self._steps = experiment, piece, time, steps
        self._pieces += 1
        self.instants.append(replace(first, time=time))

    def _take(self) -> None:
        instant = next(self._steps)
        self.instants.append(replace(instant, time=self._since + instant.time))


def _widths(forms: xr.Dataset) -> Any:
    """Return what tells whether instants of two experiments stand in one table."""
    names = ("coordinate", "velocity", "feature_unit", "mark_camera", "mark_target")
    return [forms[name].values.tolist() for name in names]


def _table(forms: xr.Dataset, instants: list[Instant], experiment: Experiment) -> xr.Dataset:
    """Return instants as a run has them; `forms` is such a run of one instant."""
    whose = "camera" if "camera_velocity" in forms else "frame"
    parts = ("q", "qd", "error", "pixels", "qd_actual")
    q, qd, error, pixels, rates = (np.stack([getattr(x, n) for x in instants]) for n in parts)
    frame = forms[f"{whose}_velocity"].attrs["frame"]
    _, twists = frame_motion(experiment.scene, frame, q[None], rates[None])
    values = {
        "q": q,
        "qd": qd,
        "error": error,
        "error_norm": np.linalg.norm(error, axis=1),
        "pixels": pixels,
        f"{whose}_velocity": twists[0],
    }
    many = forms.isel(time=np.zeros(len(instants), dtype=int))
    many = many.assign({name: (many[name].dims, x) for name, x in values.items()})
    return many.assign_coords(time=("time", np.array([each.time for each in instants])))
