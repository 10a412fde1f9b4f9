"""What the remaining error of a calibration costs a servo loop."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from robsim.base.arrays import Array, frozen, whole
from robsim.base.errors import InputError
from robsim.base.values import Value
from robsim.calibration.fit import CalibrationFit
from robsim.calibration.model import Model
from robsim.geometry.rotation import rpy_of
from robsim.run.checks import of_kind
from robsim.run.experiment import Experiment
from robsim.statistics.estimate import Estimate
from robsim.statistics.random_numbers import Draws
from robsim.studies.door import study
from robsim.studies.plan import MOST_RUNS
from robsim.studies.samplers import Given
from robsim.studies.sensitivity import Sensitivity, sensitivity
from robsim.studies.study import Study
from robsim.world.mounted_camera import MountedCamera

DRAWN = "calibration"  # the name of the random numbers of errors
PARTS = ("mount", "lens")  # of a calibration, which a belief has


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationCost(Value):
    """How an experiment ends whose controller believes the camera as the calibration leaves it.

    study   one run for each draw of the errors of mount and lens
    exact   the same runs, with the same noise, of a controller that believes the truth
    errors  (runs, n) those errors, in the order of `names`, m, rad and px
    """

    study: Study
    exact: Study
    errors: Array
    names: tuple[str, ...]

    @property
    def converged(self) -> Estimate:
        """The share of the runs that converged, with its interval."""
        return self.study.converged()

    @property
    def metres(self) -> tuple[float, float]:
        """The median distance from the goal of the runs that converged, and of the exact ones."""
        return _median(self.study, "distance_to_goal"), _median(self.exact, "distance_to_goal")

    @property
    def radians(self) -> tuple[float, float]:
        """The median angle from the goal of the runs that converged, and of the exact ones."""
        return _median(self.study, "angle_to_goal"), _median(self.exact, "angle_to_goal")

    def sensitivity(self, of: str = "distance_to_goal") -> Sensitivity:
        """Return which number of the calibration matters most for a column of the study."""
        table = self.study.table
        columns = dict(zip(self.names, self.errors[table["draw"]].T, strict=True))
        return sensitivity(table.assign(**columns), of, list(self.names))

    def __str__(self) -> str:
        """Return the share that converged, and how far from the goal, with the exact ones."""
        (far, least), (turned, least_turned) = self.metres, np.degrees(self.radians)
        return (
            f"{self.converged} converged, median {1e3 * far:.3g} mm and {turned:.3g} deg off the "
            f"goal\nexact: {self.exact.converged()} converged, median {1e3 * least:.3g} mm and "
            f"{least_turned:.3g} deg"
        )

    def __repr__(self) -> str:
        return f"<CalibrationCost {self.converged} converged>"


def _median(of: Study, column: str) -> float:
    """Return the median of a column over the runs that converged; NaN of none."""
    ended = of.table[of.table["outcome"] == "CONVERGED"][column]
    return float(np.median(ended)) if len(ended) else math.nan


def cost(
    found: CalibrationFit, experiment: Any, runs: int = 200, *, seed: int = 0, **how: Any
) -> CalibrationCost:
    """Return how an experiment ends if its controller believes what a calibration may have found.

    runs  draws of the errors of mount and lens, from their covariance as a normal distribution
    seed  of these draws
    how   more for `study`: start, threads ...

    The true scene is that of the experiment, and the controller believes its camera with the errors
    of a draw. Errors of the mount bend the way; an image or pose of the camera that is the goal is
    reached all the same, while errors of the lens move the end of a goal that is computed.
    InputError: no such camera in the experiment, or a lens of another kind.

    >>> from robsim import examples, load_scenario
    >>> from robsim.calibration.calibrate import calibrate
    >>> from robsim.calibration.observing import observe
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> turns = np.radians([[0, 0, 0, 0, 0, 0], [9, 9, 9, 9, 9, 0], [0, 9, -9, 9, -9, 30]])
    >>> cost(calibrate(observe(bench, bench.start + turns)), bench, 20)
    <CalibrationCost 100.0 % [83.9, 100.0] converged>
    """
    of_kind(experiment, Experiment, "experiment")
    count = whole(runs, "runs", 1, MOST_RUNS)
    chosen = np.r_[*(found.free.parts[name] for name in PARTS)]
    errors = _drawn(found.covariance[np.ix_(chosen, chosen)], count, seed)
    steps = np.zeros((count, len(found.names)))
    steps[:, chosen] = errors
    sure, wrong = _beliefs(found, experiment.scene.camera(found.views.camera), steps)
    exact = experiment.at(sure)
    made = study(exact, count, vary=wrong, **how), study(exact, count, **how)
    return CalibrationCost(*made, frozen(errors), tuple(found.names[i] for i in chosen))


def _beliefs(
    found: CalibrationFit, eye: MountedCamera, steps: Array
) -> tuple[dict[str, Array], dict[str, Given]]:
    """Return the true numbers of a camera by their names as a belief, and those with errors."""
    if len(eye.camera.distortion) != len(found.camera.distortion):
        raise InputError(
            f"camera '{eye.name}': its lens has {len(eye.camera.distortion)} coefficients, and "
            f"{len(found.camera.distortion)} were calibrated"
        )
    true = Model(eye.pose, found.place, eye.camera, found.offsets)
    believed = _numbers([true.moved(step, found.free) for step in steps], true)
    names = {key: f"belief.cameras.{eye.name}.{key}" for key in believed}
    sure = {names[key]: values[0] for key, values in _numbers([true], true).items()}
    differ = {names[key]: x for key, x in believed.items() if (x != sure[names[key]]).any()}
    return sure, {name: Given(values) for name, values in differ.items()}


def _drawn(C: Array, count: int, seed: int) -> Array:
    """Return (count, n) draws of a normal distribution of mean 0 and covariance C (n, n)."""
    scale = np.sqrt(np.diag(C))
    half = np.linalg.cholesky(C / np.outer(scale, scale)) * scale[:, None]
    draws = Draws(whole(seed, "seed", 0, 2**64), DRAWN, np.arange(count))
    return np.asarray(draws.normal(len(C)) @ half.T)


def _numbers(models: list[Model], true: Model) -> dict[str, Array]:
    """Return the numbers (n, ...) of cameras by their keys in the table of a camera."""
    K = np.array([model.camera.K for model in models])
    rpy = np.array([rpy_of(model.mount.rotation) for model in models])
    turns = np.round((rpy - rpy_of(true.mount.rotation)) / (2 * np.pi))
    return {
        "position": np.array([model.mount.position for model in models]),
        "rpy": rpy - 2 * np.pi * turns,  # so that no number leaps by a turn
        "focal": K[:, [0, 1], [0, 1]],
        "center": K[:, :2, 2],
        "skew": K[:, 0, 1],
        "distortion": np.array([model.camera.distortion for model in models]),
    }
