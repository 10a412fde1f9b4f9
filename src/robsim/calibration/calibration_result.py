"""The result of a calibration: mount, target and lens, with their uncertainty."""

from __future__ import annotations

import math
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
from robsim.calibration.next_poses import NextPoses, select_next_poses
from robsim.run.run_checks import check_instance
from robsim.statistics.fisher_distribution import fisher_quantile
from robsim.world.scene import Scene

if TYPE_CHECKING:
    from robsim.calibration.servo_cost import CalibrationCost
    from robsim.run.experiment import Experiment

SHOWN = {"m": (1e3, "mm"), "rad": (180 / math.pi, "deg"), "px": (1.0, "px"), "1": (1.0, "")}
# pixels, or multiples of the noise: detectors have errors of tenths of a pixel, mixed-up views of
# tens of pixels
FAR = 3.0


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
        Standard deviation of a pixel coordinate, estimated or given.
    freedom : float
        Degrees of freedom of sigma, infinite if it was given.
    residuals : ndarray of shape (V, N, 2)
        Reprojected minus measured pixels, NaN for marks that were not seen.

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
        """A warning with the worst view if `rms` is too large to be noise, otherwise ""."""
        return describe_misfit(self.residuals, self.sigma if math.isinf(self.freedom) else 0.0)

    @property
    def deviations(self) -> dict[str, float]:
        """The standard deviation of each parameter by its name, in m, rad and px."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    def errors(self, truth: Scene) -> Array:
        """Return the errors (P,) of the estimate, as a step to the truth in the order of `names`.

        Parameters
        ----------
        truth : Scene
            Scene with the true camera and target. The true offsets of joints are zero.

        Raises
        ------
        InputError
            If the scene lacks the camera or the target.
        """
        check_instance(truth, Scene, "truth")
        eye, thing = truth.camera(self.views.camera), truth.object(self.views.target)
        true_model = CalibrationModel(
            eye.pose, thing.pose, eye.camera, np.zeros_like(self.model.offsets)
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
        part : {"mount", "target", "lens", "joints"}, default "mount"
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

    def __str__(self) -> str:
        """Return a table of parameters and standard deviations, in mm, degrees and pixels."""
        rows = align_columns([list(c) for c in zip(*self._rows, strict=True)])
        return "\n".join([self._title, *filter(None, [self.misfit]), *rows])

    def __repr__(self) -> str:
        return f"<Calibration {self._title}>"

    def _repr_html_(self) -> str:
        """Return the table for notebooks."""
        head, *rows = self._rows
        title = "; ".join(filter(None, [self._title, self.misfit]))
        return format_html_table(title, rows, head)

    @property
    def _title(self) -> str:
        """The camera, the number of views, the rms error and the noise, as a line of text."""
        source = "given" if math.isinf(self.freedom) else "estimated"
        return (
            f"'{self.views.camera}' on {self.views.eye.on}, from {len(self.views)} views: "
            f"rms {self.rms:.3g} px, noise {self.sigma:.3g} px ({source})"
        )

    @property
    def _rows(self) -> list[tuple[str, ...]]:
        """The head and the rows of the table; a pose has its position and rotation vector."""
        poses = [[*T.position.tolist(), *T.rotvec.tolist()] for T in (self.mount, self.place)]
        values = [*poses[0], *poses[1], *self.model.numbers(self.free)]
        rows: list[tuple[str, ...]] = [("number", "unit", "value", "std")]
        each = zip(self.deviations.items(), self.free.units, values, strict=True)
        for (name, std), unit, value in each:
            factor, shown = SHOWN[unit]
            rows.append((name, shown, f"{factor * value:z.6g}", f"{factor * std:.2g}"))
        return rows


def root_mean_square(residuals: Array) -> float:
    """Return the root mean square of residuals of any shape, without NaN.

    >>> root_mean_square(np.array([3.0, np.nan, -3.0]))
    3.0
    """
    return float(np.sqrt(np.nanmean(np.square(residuals))))


def describe_misfit(residuals: Array, noise: float) -> str:
    """Return a warning if residuals (V, N, 2) in pixels are too large to be noise, otherwise "".

    They are too large if their root mean square exceeds 3 pixels and three times the noise in
    pixels (0: unknown). NaN stands for marks that are not seen.

    >>> describe_misfit(np.full((3, 4, 2), 0.3), 0.0)
    ''
    >>> describe_misfit(np.array([[[6.0, 8.0]], [[3.0, 4.0]]]), 0.5)[:59]
    'the marks are 5.59 px off (rms), worst in view 0 (7.07 px):'
    """
    rms = root_mean_square(residuals)
    if rms <= FAR * max(1.0, noise):
        return ""
    each = [root_mean_square(view) for view in residuals]
    worst = int(np.argmax(each))
    return (
        f"the marks are {rms:.3g} px off (rms), worst in view {worst} ({each[worst]:.3g} px): "
        "swapped columns and rows, another size or order of the marks, or views and joints that "
        "do not belong together?"
    )
