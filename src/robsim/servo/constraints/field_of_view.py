"""Constraint: marks stay in the image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, Number, PerRun, register
from robsim.features.feature_rows import concatenate_rows
from robsim.kernels.control import view_barriers
from robsim.servo.camera_target import CameraTarget
from robsim.servo.constraints.constraint import (
    VIEW,
    BarrierRate,
    ConstraintInputs,
    ConstraintPlace,
    ConstraintRows,
    RowConstraint,
    join_rows,
)
from robsim.servo.constraints.frame_motion import add_camera_drift
from robsim.servo.constraints.mark_selection import (
    CameraOfMarks,
    DepthError,
    TargetOfMarks,
    name_marks,
    select_sights,
    select_views,
)

SIDES = "left", "right", "top", "bottom"


@register("constraint", "field_of_view")
@dataclass(frozen=True)
class FieldOfView(RowConstraint, DeclaredValue):
    """Constraint of the image: every mark keeps a distance from its border.

    For each mark and each side of the image h is the distance in pixels from the side, less
    `margin`. The rate of h follows from the interaction matrix of the pixel, so the constraint
    acts for any feature. A mark beyond the margin is brought back at twice the `rate`.

    The rate depends on the depth and on the focal length that the controller believes. With
    `depth_error` and `focal_error` the constraint holds for all combinations of their extreme
    values, since the rate of a pixel is affine in 1/Z: for every depth in
    [Z / (1 + depth_error), Z / (1 - depth_error)]. `noise` is added to the margin. In old images
    the marks are moved to the present by the last commands.

    Raises
    ------
    InputError
        By `simulate`, if the size of the image is unknown, if `margin` and `noise` leave no room
        in it, or if the task has no such camera or target, or only features of pictures.

    Notes
    -----
    If true depth, focal length, lens and noise are within the declared bounds, h falls by no more
    than the rate in the first order of the period: a run can leave the margin by at most the
    curvature of the path of a mark in one period, |d2h/dt2| dt^2 / 2, and the margin is there for
    it. The change of the rows from the last period estimates this curvature, and raises the bound
    where h falls faster than in the first order. Bounds on depth as a condition that belief and
    truth can test are from arXiv:2410.01277.

    Examples
    --------
    A position-based law turns the camera, and a mark leaves the image:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("pbvs_loses_target"))
    >>> for law in "joint", rs.laws.ConstrainedLaw([FieldOfView(margin=8)]):
    ...     print(rs.Outcome(int(scenario.at("task.law", law).run().outcome)).name)
    OUT_OF_IMAGE
    CONVERGED
    """

    level: ClassVar[int] = VIEW
    margin: Annotated[
        float, Number(least=0.0, unit="px"), PerRun(()), "Distance from the border, in pixels."
    ] = 8.0
    rate: BarrierRate = 4.0
    noise: Annotated[
        float, Number(least=0.0, unit="px"), PerRun(()), "Largest error of a mark, in pixels."
    ] = 0.0
    depth_error: DepthError = 0.0
    focal_error: Annotated[
        float,
        Number(least=0.0, below=1.0),
        PerRun(()),
        "Largest relative error of the focal length.",
    ] = 0.0
    camera: CameraOfMarks = None
    target: TargetOfMarks = None

    @property
    def is_robust(self) -> bool:
        """Whether depth or focal length may be wrong."""
        return bool(np.any(self.depth_error) or np.any(self.focal_error))

    def label(self, place: ConstraintPlace) -> list[str]:
        """Return the names of the rows, for each mark the sides of the image.

        Parameters
        ----------
        place : ConstraintPlace
            Scene in which the constraint acts.

        Returns
        -------
        list of str
            Names such as "left border for mark 2".
        """
        sights = select_sights(self, place)
        for sight in sights:
            self._check_room(sight)
        ends = 4 if self.is_robust else 1
        return [
            f"{side} border for {mark}"
            for mark in name_marks(sights, place)
            for side in SIDES
            for _ in range(ends)
        ]

    def _check_room(self, sight: CameraTarget) -> None:
        """Raise InputError unless the margin leaves room in the image."""
        size = sight.eye.camera.size
        if size is None:  # an image without a border, as in the analysis of a law
            return
        margin = float(np.max(self.margin)) + float(np.max(self.noise))
        if 2.0 * margin >= min(size):
            raise InputError(
                f"FieldOfView: a margin of {margin:g} px leaves no room in the image of "
                f"'{sight.eye.name}', {size[0]} x {size[1]}"
            )

    def check(self, place: ConstraintPlace) -> None:
        """Raise InputError if the size of an image is unknown.

        Parameters
        ----------
        place : ConstraintPlace
            Scene in which the constraint acts.

        Raises
        ------
        InputError
            If a camera has no size.
        """
        for sight in select_sights(self, place):
            if sight.eye.camera.size is None:
                raise InputError(f"FieldOfView: the size of camera '{sight.eye.name}' is unknown")

    def stages(self, of: ConstraintInputs) -> ConstraintRows:
        """Add the stages of the rows; return them, in the order of `label`."""
        program, n = of.inputs.program, of.columns.size
        settings = [self.margin, self.rate, self.noise, self.depth_error, self.focal_error]
        numbers = concatenate_rows(program, [program.number(each).flat for each in settings])
        ends, age = 4 if self.is_robust else 1, of.inputs.age
        each = []
        for view in select_views(self, of):
            N, eye = view.depth.size, view.sight.eye.camera
            rows = ConstraintRows(program.rows(4 * ends * N, n), program.rows(4 * ends * N))
            program.add(
                view_barriers.compute_border_rows,
                pixels=view.pixels,
                points=view.points,
                depth=view.depth,
                hidden=view.hidden,
                camera=program.each(eye.rows),
                lens=eye.lens_kind,
                J=view.J,
                settings=numbers,
                dt=of.inputs.dt,
                drift=add_camera_drift(of, *view.sight.key),
                age=age,
                past=of.past,
                ends=ends,
                C=rows.C,
                bound=rows.bound,
            )
            each.append(rows)
        return join_rows(of, each)
