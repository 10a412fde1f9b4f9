"""The parameters estimated by a calibration, with their covariance."""

from __future__ import annotations

from dataclasses import dataclass, replace

from robsim.base.arrays import Array, make_read_only
from robsim.base.value import Value
from robsim.calibration.calibration_model import CalibrationModel, Unknowns
from robsim.calibration.calibration_views import CalibrationViews
from robsim.geometry.pose import Pose
from robsim.vision.camera import Camera
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationFit(Value):
    """The model that fits some views best, and the covariance of its parameters."""

    views: CalibrationViews
    model: CalibrationModel
    free: Unknowns
    covariance: Array
    sigma: float
    freedom: float
    residuals: Array

    @property
    def mount(self) -> Pose:
        """The pose T_m_c of the camera on the frame that carries it."""
        return self.model.mount

    @property
    def place(self) -> Pose:
        """The pose T_f_o of the target on the frame that carries it."""
        return self.model.place

    @property
    def camera(self) -> Camera:
        """The camera with the estimated parameters of its lens."""
        return self.model.camera

    @property
    def offsets(self) -> Array:
        """The offsets (nq,) added to encoder coordinates, zero if they are not estimated."""
        return make_read_only(self.model.offsets.copy())

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the estimated parameters, in the order of `covariance`."""
        return self.free.names

    @property
    def scene(self) -> Scene:
        """The scene of the views with the estimated camera and the estimated pose of the target.

        A controller may believe it: `experiment.with_(task=replace(task, belief=...))`.
        """
        eye = replace(self.views.eye, pose=Pose(self.mount.matrix), camera=self.camera)
        return self.views.scene.replacing(
            eye, replace(self.views.thing, pose=Pose(self.place.matrix))
        )
