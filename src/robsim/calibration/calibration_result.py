"""The result of a calibration: mount, target and lens, with their uncertainty."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value, is_known_name, suggest_names
from robsim.base.html import format_html_table
from robsim.base.text_tables import align_columns
from robsim.calibration.calibration_fit import CalibrationFit
from robsim.calibration.calibration_model import CalibrationModel
from robsim.calibration.calibration_text import format_camera, list_table_rows
from robsim.calibration.fit_test import FitTest
from robsim.calibration.misfit_trials import MisfitTrial, describe_trials
from robsim.calibration.next_poses import NextPoses, select_next_poses
from robsim.run.run_checks import check_instance
from robsim.statistics.fisher_distribution import fisher_quantile
from robsim.world.scene import Scene

if TYPE_CHECKING:
    from robsim.calibration.servo_cost import CalibrationCost
    from robsim.run.experiment import Experiment


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(CalibrationFit):
    """The result of `calibrate`: the mount of a camera, the pose of its target, and its lens.

    Attributes
    ----------
    views : CalibrationViews
        Views of the target.
    model : CalibrationModel
        Estimated values; `mount`, `place`, `camera` and `offsets` are its parts.
    free : Unknowns
        Names and units of the estimated parameters.
    covariance : ndarray of shape (P, P)
        Covariance of the parameters `names` in m, rad and px. The first six are the twist (v,
        omega) of the true mount relative to the estimate, true mount = mount exp(twist), in camera
        axes. The next six are the same for `place`, in axes of the target. The parameters named in
        `also` follow.
    sigma : float
        Standard deviation of a pixel coordinate: estimated from the residuals, or given if the
        given value is larger. In a misfit it also accounts for errors that the marks of a view have
        in common.
    freedom : float
        Degrees of freedom of the covariance, infinite if the noise was given.
    residuals : ndarray of shape (V, N, 2)
        Reprojected minus measured pixels, NaN for marks that were not seen.
    test : FitTest
        Whether the residuals are a misfit, and the noise that they were compared with.
    trials : tuple of MisfitTrial
        Causes of a misfit that were tried, the likeliest first; empty without a misfit.

    Examples
    --------
    >>> from robsim import calibrate, examples, load_scenario
    >>> from robsim.calibration import simulate_views
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> turns = np.radians([[0, 0, 0, 0, 0, 0], [9, 9, 9, 9, 9, 0], [0, 9, -9, 9, -9, 30]])
    >>> q = bench.start + turns
    >>> calibration = calibrate(simulate_views(bench, q), ["focal", "center"])
    >>> calibration.covariance.shape, calibration.names[12:]
    ((16, 16), ('fx', 'fy', 'cx', 'cy'))
    >>> calibration.holds(bench.scene, "lens")
    True
    """

    @property
    def rms(self) -> float:
        """The root mean square of all residuals, in pixels."""
        return root_mean_square(self.residuals)

    @property
    def misfit(self) -> str:
        """A warning with the worst view and its cause if `rms` is too large to be noise, or ""."""
        return describe_misfit(self.residuals, self.test, self.trials) if self.test.misfit else ""

    def errors(self, truth: Scene) -> Array:
        """Return the errors (P,) of the estimate, as a step to the truth in the order of `names`.

        Parameters
        ----------
        truth : Scene
            Scene with the true camera and target. The true offsets of joints are zero, and the true
            scale is the size of its marks relative to the marks of the views.

        Raises
        ------
        InputError
            If the scene lacks the camera or the target.
        """
        check_instance(truth, Scene, "truth")
        eye, thing = truth.camera(self.views.camera), truth.object(self.views.target)
        scale = relative_size(thing.marks, self.views.thing.marks) if self.free.scaled else 1.0
        true_model = CalibrationModel(
            eye.pose, thing.pose, eye.camera, np.zeros_like(self.model.offsets), scale
        )
        return self.model.step_to(true_model, self.free)

    def holds(self, truth: Scene, part: str = "mount", level: float = 0.95) -> bool:
        """Return whether the confidence ellipsoid contains the true parameters.

        For n parameters with errors d and covariance C, the ellipsoid is d' C^-1 d <= n F, with the
        quantile F of Fisher's distribution with n and `freedom` degrees of freedom. If the noise
        was given, n F is the quantile of the chi-square distribution with n degrees of freedom.

        Parameters
        ----------
        truth : Scene
            Scene with the true camera and target.
        part : {"mount", "target", "lens", "joints", "scale"}, default "mount"
            Parameters to compare.
        level : float, default 0.95
            Confidence level.

        Raises
        ------
        InputError
            If the calibration has no parameters of this part.
        """
        known = [name for name, part in self.free.parts.items() if part.start < part.stop]
        if not is_known_name(part, known):
            raise InputError(
                f"part: no {format_value(part)}; {suggest_names(part, known, 'parts')}"
            )
        selection = self.free.parts[part]
        d, C = self.errors(truth)[selection], self.covariance[selection, selection]
        bound = len(d) * fisher_quantile(level, len(d), self.freedom)
        return bool(d @ np.linalg.solve(C, d) <= bound)

    def next_poses(self, candidates: ArrayLike, count: int) -> NextPoses:
        """Return the most informative candidates for the next views.

        Parameters
        ----------
        candidates : array_like of shape (n, nq)
            Coordinates to choose from, for example from `sample_viewpoints`.
        count : int
            Number of views to choose.

        Returns
        -------
        NextPoses
            Coordinates, and standard deviations of the mount after each view.
        """
        return select_next_poses(self, candidates, count)

    def cost(
        self,
        experiment: Experiment,
        runs: int = 200,
        **how: Any,  # Any: the further arguments of `study`
    ) -> CalibrationCost:
        """Return the effect of the remaining calibration error on an experiment.

        Parameters
        ----------
        experiment : Experiment
            Experiment to run.
        runs : int, default 200
            Number of samples of the errors.
        **how
            `seed` of the samples, and further arguments of `study`.

        Returns
        -------
        CalibrationCost
            Runs with sampled errors of the mount and the lens, and exact runs.
        """
        from robsim.calibration.servo_cost import estimate_servo_cost

        return estimate_servo_cost(self, experiment, runs, **how)

    def to_toml(self) -> str:
        """Return the calibrated camera as a table of a scenario file.

        Returns
        -------
        str
            TOML text of `[[cameras]]` with the mount as position (mm) and rpy (deg), and the lens,
            to ten significant digits. `Experiment.to_toml` writes `scene` to the last bit.
        """
        return format_camera(self)

    def __str__(self) -> str:
        """Return the poses, other numbers and their deviations as a table, and the camera as TOML.

        The deviations of a position are along the axes of its frame. `deviations` are along the
        axes of the camera and of the target.
        """
        rows = align_columns([list(c) for c in zip(*list_table_rows(self), strict=True)])
        lines = [self._title, *filter(None, [self.misfit]), *(row.rstrip() for row in rows)]
        return "\n".join([*lines, "", self.to_toml().rstrip()])

    def __repr__(self) -> str:
        return f"<Calibration {self._title}>"

    def _repr_html_(self) -> str:
        """Return the table for notebooks."""
        head, *rows = list_table_rows(self)
        title = "; ".join(filter(None, [self._title, self.misfit]))
        return format_html_table(title, rows, head)

    @property
    def _title(self) -> str:
        """The camera, the number of views, the rms error and the noise, as a line of text."""
        given, misfit = self.test.given, self.test.misfit
        noise = self.test.noise if given or misfit else self.sigma
        source = "given" if given else "within views" if misfit else "estimated"
        return (
            f"'{self.views.camera}' on {self.views.eye.on}, target '{self.views.target}' on "
            f"{self.views.thing.on}, from {len(self.views)} views: "
            f"rms {self.rms:.3g} px, noise {noise:.3g} px ({source})"
        )


def relative_size(marks: Array, others: Array) -> float:
    """Return the size of marks (N, 3) relative to the size of others, by least squares.

    >>> relative_size(np.array([[3.0, 0, 0], [0, 3, 0]]), np.array([[2.0, 0, 0], [0, 2, 0]]))
    1.5
    """
    return float((marks * others).sum() / np.square(others).sum())


def root_mean_square(residuals: Array) -> float:
    """Return the root mean square of residuals of any shape, without NaN.

    >>> root_mean_square(np.array([3.0, np.nan, -3.0]))
    3.0
    """
    return float(np.sqrt(np.nanmean(np.square(residuals))))


def describe_misfit(residuals: Array, test: FitTest, trials: tuple[MisfitTrial, ...]) -> str:
    """Return the size of residuals (V, N, 2) in pixels, their noise, and their cause by trial.

    NaN stands for marks that are not seen.

    >>> test = FitTest(0.2, True, True, 4.0, 10.0)
    >>> describe_misfit(np.array([[[6.0, 8.0]], [[3.0, 4.0]]]), test, ())[:60]
    'the marks are 5.59 px off (rms), worst in view 0 (7.07 px), '
    """
    each = [root_mean_square(view) for view in residuals]
    worst = int(np.argmax(each))
    noise = f"{test.noise:.3g} px"
    reference = f"for a noise of {noise}" if test.given else f"and in each view by itself {noise}"
    return (
        f"the marks are {root_mean_square(residuals):.3g} px off (rms), worst in view {worst} "
        f"({each[worst]:.3g} px), {reference}: {describe_trials(trials)}"
    )
