"""The parameters estimated by a calibration, with their covariance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.value import Value
from robsim.calibration.calibration_model import CalibrationModel, Unknowns
from robsim.calibration.calibration_views import CalibrationViews
from robsim.calibration.fit_test import FitTest
from robsim.calibration.misfit_trials import MisfitTrial
from robsim.geometry.pose import Pose
from robsim.vision.camera import Camera
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationFit(Value):
    """The model with the least reprojection error in some views, and its covariance.

    Attributes
    ----------
    views : CalibrationViews
        Views of the target.
    model : CalibrationModel
        Estimated mount, place of the target, camera and offsets of joints.
    free : Unknowns
        Names and units of the estimated parameters.
    covariance : ndarray of shape (P, P)
        Covariance of the parameters.
    sigma : float
        Standard deviation of a pixel coordinate in `covariance`.
    freedom : float
        Degrees of freedom of sigma.
    residuals : ndarray of shape (V, N, 2)
        Reprojected minus measured pixels.
    test : FitTest
        Residuals in relation to the noise.
    trials : tuple of MisfitTrial
        Causes of a misfit that were tried, the likeliest first.
    """

    views: CalibrationViews
    model: CalibrationModel
    free: Unknowns
    covariance: Array
    sigma: float
    freedom: float
    residuals: Array
    test: FitTest
    trials: tuple[MisfitTrial, ...] = ()

    @property
    def mount(self) -> Pose:
        """The pose T_m_c of the camera in the frame m that carries it."""
        return self.model.mount

    @property
    def place(self) -> Pose:
        """The pose T_f_o of the target in the frame f that carries it."""
        return self.model.place

    @property
    def camera(self) -> Camera:
        """The camera with the estimated parameters of its lens."""
        return self.model.camera

    @property
    def offsets(self) -> Array:
        """The offsets (nq,) to add to the encoder coordinates, zero if they are not estimated."""
        return make_read_only(self.model.offsets.copy())

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the estimated parameters, in the order of `covariance`."""
        return self.free.names

    @property
    def deviations(self) -> dict[str, float]:
        """The standard deviation of each parameter by its name, in m, rad and px."""
        return dict(zip(self.names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def scene(self) -> Scene:
        """The scene of the views with the estimated camera, and pose and size of the target.

        Give it to a controller as its belief: `experiment.with_(task=replace(task, belief=...))`.
        """
        eye = replace(self.views.eye, pose=Pose(self.mount.matrix), camera=self.camera)
        thing = self.views.thing
        marks = thing.marks if self.model.scale == 1.0 else self.model.scale * thing.marks
        return self.views.scene.replacing(
            eye, replace(thing, pose=Pose(self.place.matrix), marks=marks)
        )
