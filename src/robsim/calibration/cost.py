"""What the remaining error of a calibration costs a servo loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.analysis.shares import Share
from robsim.base.arrays import Array, frozen, whole
from robsim.base.errors import InputError
from robsim.base.values import Value
from robsim.calibration.model import Model
from robsim.robot.urdf.values import rpy_of
from robsim.run.checks import of_kind
from robsim.run.experiment import Experiment
from robsim.studies.door import study
from robsim.studies.draws import Draws
from robsim.studies.plan import MOST_RUNS
from robsim.studies.samplers import Given
from robsim.studies.sensitivity import Sensitivity, sensitivity
from robsim.studies.study import Study

if TYPE_CHECKING:
    from robsim.calibration.result import Calibration

DRAWN = "calibration"  # the name of the random numbers of errors
PARTS = ("mount", "lens")  # of a calibration, which a belief has


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationCost(Value):
    """How an experiment ends whose controller believes the camera as the calibration leaves it.

    study   one run for each draw of the errors of mount and lens
    errors  (runs, n) those errors, in the order of `names`, m, rad and px
    """

    study: Study
    errors: Array
    names: tuple[str, ...]

    @property
    def converged(self) -> Share:
        """The share of the runs that converged, with its interval."""
        return self.study.converged()

    @property
    def metres(self) -> float:
        """The median distance from the goal at the end of the runs that converged, metres."""
        return self._median("distance_to_goal")

    @property
    def radians(self) -> float:
        """Likewise the median angle, radians."""
        return self._median("angle_to_goal")

    def sensitivity(self, of: str = "distance_to_goal") -> Sensitivity:
        """Return which number of the calibration matters most for a column of the study."""
        table = self.study.table
        columns = dict(zip(self.names, self.errors[table["draw"]].T, strict=True))
        return sensitivity(table.assign(**columns), of, list(self.names))

    def _median(self, column: str) -> float:
        table = self.study.table
        ended = table[table["outcome"] == "CONVERGED"][column]
        return float(np.median(ended)) if len(ended) else float("nan")

    def __str__(self) -> str:
        """Return the share that converged, and how far from the goal, in a line."""
        return (
            f"{self.converged} converged; median {1e3 * self.metres:.3g} mm and "
            f"{np.degrees(self.radians):.3g} deg off the goal"
        )

    def __repr__(self) -> str:
        return f"<CalibrationCost {self}>"


def cost(
    found: Calibration, experiment: Any, runs: int = 200, *, seed: int = 0, **how: Any
) -> CalibrationCost:
    """Return how an experiment ends if its controller believes what a calibration may have found.

    runs  draws of the errors of mount and lens, from their covariance as a normal distribution
    seed  of these draws
    how   more for `study`: start, threads, store ...

    The true scene is that of the experiment, and the controller believes its camera with the errors
    of a draw. Errors of the mount bend the way; an image or pose of the camera that is the goal is
    reached all the same, while errors of the lens move the end of a goal that is computed.
    InputError: no such camera in the experiment, or on another frame.

    """
    of_kind(experiment, Experiment, "experiment")
    count = whole(runs, "runs", 1, MOST_RUNS)
    eye = experiment.scene.camera(found.views.camera)
    if len(eye.camera.distortion) != len(found.camera.distortion):
        raise InputError(
            f"camera '{eye.name}': its lens has {len(eye.camera.distortion)} coefficients, and "
            f"{len(found.camera.distortion)} were calibrated"
        )
    chosen = np.r_[*(found.free.parts[name] for name in PARTS)]
    errors = _drawn(found.covariance[np.ix_(chosen, chosen)], count, seed)
    steps = np.zeros((count, len(found.names)))
    steps[:, chosen] = errors
    true = Model(eye.pose, found.place, eye.camera, found.offsets)
    believed = [true.moved(step, found.free) for step in steps]
    vary = {f"belief.cameras.{eye.name}.{k}": v for k, v in _numbers(believed, true).items()}
    made = study(experiment, count, vary=vary, **how)
    return CalibrationCost(made, frozen(errors), tuple(found.names[i] for i in chosen))


def _drawn(C: Array, count: int, seed: int) -> Array:
    """Return (count, n) draws of a normal distribution of mean 0 and covariance C (n, n)."""
    scale = np.sqrt(np.diag(C))
    half = np.linalg.cholesky(C / np.outer(scale, scale)) * scale[:, None]
    draws = Draws(whole(seed, "seed", 0, 2**64), DRAWN, np.arange(count))
    return np.asarray(draws.normal(len(C)) @ half.T)


def _numbers(believed: list[Model], true: Model) -> dict[str, Given]:
    """Return what is believed in each draw by its key in the table of a camera."""
    K = np.array([model.camera.K for model in believed])
    rpy = np.array([rpy_of(model.mount.rotation) for model in believed])
    nominal = rpy_of(true.mount.rotation)
    turns = np.round((rpy - nominal) / (2 * np.pi))  # so that no number leaps by a turn
    found = {
        "position": np.array([model.mount.position for model in believed]),
        "rpy": rpy - 2 * np.pi * turns,
    }
    if (K != true.camera.K).any():
        found |= {"focal": K[:, [0, 1], [0, 1]], "center": K[:, :2, 2]}
    lens = np.array([model.camera.distortion for model in believed])
    if (lens != np.array(true.camera.distortion)).any():
        found["distortion"] = lens
    return {key: Given(values) for key, values in found.items()}
