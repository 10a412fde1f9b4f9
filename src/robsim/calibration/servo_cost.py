"""What the remaining error of a calibration costs a servo loop."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from robsim.base.arrays import Array, as_integer, make_read_only
from robsim.base.errors import InputError
from robsim.base.value import Value
from robsim.calibration.calibration_fit import CalibrationFit
from robsim.calibration.calibration_model import CalibrationModel
from robsim.geometry.rotation import rotation_to_rpy
from robsim.run.experiment import Experiment
from robsim.run.run_checks import check_instance
from robsim.statistics.estimate import Estimate
from robsim.statistics.random_numbers import RandomNumbers
from robsim.studies.api import study
from robsim.studies.samplers import TabulatedValues
from robsim.studies.sensitivity import Sensitivity, compute_sensitivity
from robsim.studies.study_plan import MOST_RUNS
from robsim.studies.study_result import StudyResult
from robsim.world.mounted_camera import MountedCamera

ERROR_STREAM = "calibration"  # the name of the random numbers of errors
PARTS = ("mount", "lens")  # of a calibration, which a belief has


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationCost(Value):
    """How an experiment ends whose controller believes the camera as the calibration leaves it.

    study   one run for each draw of the errors of mount and lens
    exact   the same runs, with the same noise, of a controller that believes the truth
    errors  (runs, n) those errors, in the order of `names`, m, rad and px
    """

    study: StudyResult
    exact: StudyResult
    errors: Array
    names: tuple[str, ...]

    @property
    def converged(self) -> Estimate:
        """The share of the runs that converged, with its interval."""
        return self.study.converged()

    @property
    def metres(self) -> tuple[float, float]:
        """The median distance from the goal of the runs that converged, and of the exact ones."""
        return _median_of_converged(self.study, "distance_to_goal"), _median_of_converged(
            self.exact, "distance_to_goal"
        )

    @property
    def radians(self) -> tuple[float, float]:
        """The median angle from the goal of the runs that converged, and of the exact ones."""
        return _median_of_converged(self.study, "angle_to_goal"), _median_of_converged(
            self.exact, "angle_to_goal"
        )

    def sensitivity(self, of: str = "distance_to_goal") -> Sensitivity:
        """Return which number of the calibration matters most for a column of the study."""
        table = self.study.table
        columns = dict(zip(self.names, self.errors[table["draw"]].T, strict=True))
        return compute_sensitivity(table.assign(**columns), of, list(self.names))

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


def _median_of_converged(of: StudyResult, column: str) -> float:
    """Return the median of a column over the runs that converged; NaN of none."""
    ended = of.table[of.table["outcome"] == "CONVERGED"][column]
    return float(np.median(ended)) if len(ended) else math.nan


def estimate_servo_cost(
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
    >>> from robsim.calibration.calibration_solver import calibrate
    >>> from robsim.calibration.simulated_views import simulate_views
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> turns = np.radians([[0, 0, 0, 0, 0, 0], [9, 9, 9, 9, 9, 0], [0, 9, -9, 9, -9, 30]])
    >>> estimate_servo_cost(calibrate(simulate_views(bench, bench.start + turns)), bench, 20)
    <CalibrationCost 100.0 % [83.9, 100.0] converged>
    """
    check_instance(experiment, Experiment, "experiment")
    count = as_integer(runs, "runs", 1, MOST_RUNS)
    chosen = np.r_[*(found.free.parts[name] for name in PARTS)]
    errors = _sample_errors(found.covariance[np.ix_(chosen, chosen)], count, seed)
    steps = np.zeros((count, len(found.names)))
    steps[:, chosen] = errors
    sure, wrong = _camera_beliefs(found, experiment.scene.camera(found.views.camera), steps)
    exact = experiment.at(sure)
    made = study(exact, count, vary=wrong, **how), study(exact, count, **how)
    return CalibrationCost(*made, make_read_only(errors), tuple(found.names[i] for i in chosen))


def _camera_beliefs(
    found: CalibrationFit, eye: MountedCamera, steps: Array
) -> tuple[dict[str, Array], dict[str, TabulatedValues]]:
    """Return the true numbers of a camera by their names as a belief, and those with errors."""
    if len(eye.camera.distortion) != len(found.camera.distortion):
        raise InputError(
            f"camera '{eye.name}': its lens has {len(eye.camera.distortion)} coefficients, and "
            f"{len(found.camera.distortion)} were calibrated"
        )
    true = CalibrationModel(eye.pose, found.place, eye.camera, found.offsets)
    believed = _camera_arrays([true.moved(step, found.free) for step in steps], true)
    names = {key: f"belief.cameras.{eye.name}.{key}" for key in believed}
    sure = {names[key]: values[0] for key, values in _camera_arrays([true], true).items()}
    differ = {names[key]: x for key, x in believed.items() if (x != sure[names[key]]).any()}
    return sure, {name: TabulatedValues(values) for name, values in differ.items()}


def _sample_errors(C: Array, count: int, seed: int) -> Array:
    """Return (count, n) draws of a normal distribution of mean 0 and covariance C (n, n)."""
    scale = np.sqrt(np.diag(C))
    half = np.linalg.cholesky(C / np.outer(scale, scale)) * scale[:, None]
    draws = RandomNumbers(as_integer(seed, "seed", 0, 2**64), ERROR_STREAM, np.arange(count))
    return np.asarray(draws.normal(len(C)) @ half.T)


def _camera_arrays(models: list[CalibrationModel], true: CalibrationModel) -> dict[str, Array]:
    """Return the numbers (n, ...) of cameras by their keys in the table of a camera."""
    K = np.array([model.camera.K for model in models])
    rpy = np.array([rotation_to_rpy(model.mount.rotation) for model in models])
    turns = np.round((rpy - rotation_to_rpy(true.mount.rotation)) / (2 * np.pi))
    return {
        "position": np.array([model.mount.position for model in models]),
        "rpy": rpy - 2 * np.pi * turns,  # so that no number leaps by a turn
        "focal": K[:, [0, 1], [0, 1]],
        "center": K[:, :2, 2],
        "skew": K[:, 0, 1],
        "distortion": np.array([model.camera.distortion for model in models]),
    }
