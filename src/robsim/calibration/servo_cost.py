"""The effect of the remaining calibration error on a servo loop."""

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

ERROR_STREAM = "calibration"  # name of the stream of random errors
PARTS = ("mount", "lens")  # parts of a calibration that a belief contains


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationCost(Value):
    """The effect of calibration errors on an experiment: runs with errors, and exact runs.

    Attributes
    ----------
    study : StudyResult
        One run for each sample of the errors of mount and lens, which the controller believes.
    exact : StudyResult
        The same runs with the same noise, with a controller that believes the true values.
    errors : ndarray of shape (runs, n)
        Sampled errors in m, rad and px, in the order of `names`.
    names : tuple of str
        Names of the calibrated parameters.

    Examples
    --------
    >>> from robsim import calibrate, examples, load_scenario
    >>> from robsim.calibration import simulate_views
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> turns = np.radians([[0, 0, 0, 0, 0, 0], [9, 9, 9, 9, 9, 0], [0, 9, -9, 9, -9, 30]])
    >>> calibration = calibrate(simulate_views(bench, bench.start + turns), ["focal", "center"])
    >>> calibration.cost(bench, 2).errors.shape
    (2, 10)
    """

    study: StudyResult
    exact: StudyResult
    errors: Array
    names: tuple[str, ...]

    @property
    def converged(self) -> Estimate:
        """The proportion of the runs with errors that converged, with its confidence interval."""
        return self.study.converged()

    @property
    def metres(self) -> tuple[float, float]:
        """The median distances from the goal in metres, of converged runs with errors and exact."""
        return _median_of_converged(self.study, "distance_to_goal"), _median_of_converged(
            self.exact, "distance_to_goal"
        )

    @property
    def radians(self) -> tuple[float, float]:
        """The median angles from the goal in radians, of converged runs with errors and exact."""
        return _median_of_converged(self.study, "angle_to_goal"), _median_of_converged(
            self.exact, "angle_to_goal"
        )

    def sensitivity(self, of: str = "distance_to_goal") -> Sensitivity:
        """Return the sensitivity of a column of the study to the error of each parameter.

        Parameters
        ----------
        of : str, default "distance_to_goal"
            Column of `study.table`.
        """
        table = self.study.table
        columns = dict(zip(self.names, self.errors[table["draw"]].T, strict=True))
        return compute_sensitivity(table.assign(**columns), of, list(self.names))

    def __str__(self) -> str:
        """Return the proportion of converged runs and their median errors, also of exact runs."""
        (mm, exact_mm), (deg, exact_deg) = 1e3 * np.array(self.metres), np.degrees(self.radians)
        return (
            f"{self.converged} converged, median {mm:.3g} mm and {deg:.3g} deg off the goal\n"
            f"exact: {self.exact.converged()} converged, median {exact_mm:.3g} mm and "
            f"{exact_deg:.3g} deg"
        )

    def __repr__(self) -> str:
        return f"<CalibrationCost {self.converged} converged>"


def _median_of_converged(of: StudyResult, column: str) -> float:
    """Return the median of a column over the converged runs, NaN if no run converged."""
    ended = of.table[of.table["outcome"] == "CONVERGED"][column]
    return float(np.median(ended)) if len(ended) else math.nan


def estimate_servo_cost(
    calibration: CalibrationFit,
    experiment: Experiment,
    runs: int = 200,
    *,
    seed: int = 0,
    **how: Any,  # Any: the further arguments of `study`
) -> CalibrationCost:
    """Return the effect of the remaining calibration error on an experiment.

    The true scene is the scene of the experiment. In each run the controller believes the true
    camera plus a sample of the calibration errors. Errors of the mount bend the path of the camera,
    but a goal image or goal pose of the camera is still reached. Errors of the lens shift the final
    pose if the goal image is computed with the believed camera.

    Parameters
    ----------
    calibration : CalibrationFit
        Calibration. Errors are sampled from the normal distribution with its covariance.
    experiment : Experiment
        Experiment to run.
    runs : int, default 200
        Number of samples of the errors.
    seed : int, default 0
        Seed of the samples.
    **how
        Further arguments of `study`, such as `start` and `threads`.

    Returns
    -------
    CalibrationCost
        Runs with the sampled errors, and exact runs.

    Raises
    ------
    InputError
        If the experiment lacks the camera, or the model of its lens or its number of distortion
        coefficients differs.

    Examples
    --------
    >>> from robsim import examples, load_scenario
    >>> from robsim.calibration.calibration_solver import calibrate
    >>> from robsim.calibration.simulated_views import simulate_views
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> turns = np.radians([[0, 0, 0, 0, 0, 0], [9, 9, 9, 9, 9, 0], [0, 9, -9, 9, -9, 30]])
    >>> calibration = calibrate(simulate_views(bench, bench.start + turns), ["focal", "center"])
    >>> estimate_servo_cost(calibration, bench, 20)
    <CalibrationCost 100.0 % [83.9, 100.0] converged>
    """
    check_instance(experiment, Experiment, "experiment")
    count = as_integer(runs, "runs", 1, MOST_RUNS)
    indices = np.r_[*(calibration.free.parts[name] for name in PARTS)]
    errors = _sample_errors(calibration.covariance[np.ix_(indices, indices)], count, seed)
    steps = np.zeros((count, len(calibration.names)))
    steps[:, indices] = errors
    true_values, samplers = _camera_beliefs(
        calibration, experiment.scene.camera(calibration.views.camera), steps
    )
    exact = experiment.at(true_values)
    studies = study(exact, count, vary=samplers, **how), study(exact, count, **how)
    return CalibrationCost(
        *studies, make_read_only(errors), tuple(calibration.names[i] for i in indices)
    )


def _camera_beliefs(
    calibration: CalibrationFit, eye: MountedCamera, steps: Array
) -> tuple[dict[str, Array], dict[str, TabulatedValues]]:
    """Return the true and the sampled parameters of a camera, by their names in a belief."""
    if eye.camera.lens != calibration.camera.lens:
        raise InputError(
            f"camera '{eye.name}': its lens is {eye.camera.lens}, and a lens that is "
            f"{calibration.camera.lens} was calibrated"
        )
    if len(eye.camera.distortion) != len(calibration.camera.distortion):
        raise InputError(
            f"camera '{eye.name}': its lens has {len(eye.camera.distortion)} coefficients, and "
            f"{len(calibration.camera.distortion)} were calibrated"
        )
    true = CalibrationModel(eye.pose, calibration.place, eye.camera, calibration.offsets)
    believed = _camera_arrays([true.add_step(step, calibration.free) for step in steps], true)
    names = {key: f"belief.cameras.{eye.name}.{key}" for key in believed}
    exact = {names[key]: values[0] for key, values in _camera_arrays([true], true).items()}
    different = {names[key]: x for key, x in believed.items() if (x != exact[names[key]]).any()}
    return exact, {name: TabulatedValues(values) for name, values in different.items()}


def _sample_errors(C: Array, count: int, seed: int) -> Array:
    """Return samples (count, n) of a normal distribution with mean 0 and covariance C (n, n)."""
    scale = np.sqrt(np.diag(C))
    half = np.linalg.cholesky(C / np.outer(scale, scale)) * scale[:, None]
    stream = RandomNumbers(as_integer(seed, "seed", 0, 2**64), ERROR_STREAM, np.arange(count))
    return np.asarray(stream.normal(len(C)) @ half.T)


def _camera_arrays(models: list[CalibrationModel], true: CalibrationModel) -> dict[str, Array]:
    """Return the parameters (n, ...) of n cameras by their keys in a scenario file."""
    K = np.array([model.camera.K for model in models])
    rpy = np.array([rotation_to_rpy(model.mount.rotation) for model in models])
    turns = np.round((rpy - rotation_to_rpy(true.mount.rotation)) / (2 * np.pi))
    return {
        "position": np.array([model.mount.position for model in models]),
        "rpy": rpy - 2 * np.pi * turns,  # angles near the true angles, without jumps by full turns
        "focal": K[:, [0, 1], [0, 1]],
        "center": K[:, :2, 2],
        "skew": K[:, 0, 1],
        "distortion": np.array([model.camera.distortion for model in models]),
    }
