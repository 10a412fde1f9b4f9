"""Constraint: marks stay in front of the camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.declare import DeclaredValue, Length, PerRun, register
from robsim.features.feature_rows import concatenate_rows
from robsim.kernels.control import view_barriers
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


@register("constraint", "mark_depth")
@dataclass(frozen=True)
class MarkDepth(RowConstraint, DeclaredValue):
    """Constraint of the depth: every mark stays in front of the camera, at `least` or farther.

    The depth Z of a mark changes with Zdot = -v_z - y Z omega_x + x Z omega_y (Chaumette and
    Hutchinson 2006, section II). With `depth_error` the constraint holds for every true depth, as
    in `FieldOfView`.

    Raises
    ------
    InputError
        By `simulate`, if the task has no such camera or target.

    Examples
    --------
    With L at the goal the camera of this start flies through the target:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("desired_through_the_target"))
    >>> for law in "joint", rs.laws.ConstrainedLaw([MarkDepth(0.1)]):
    ...     print(rs.Outcome(int(scenario.at("task.law", law).run().outcome)).name)
    BEHIND_CAMERA
    CONVERGED
    """

    level: ClassVar[int] = VIEW
    least: Annotated[float, Length(above=0), PerRun(()), "Least depth of a mark, in metres."] = 0.05
    rate: BarrierRate = 4.0
    depth_error: DepthError = 0.0
    camera: CameraOfMarks = None
    target: TargetOfMarks = None

    def label(self, place: ConstraintPlace) -> list[str]:
        """Return the names of the rows, one for each mark.

        Parameters
        ----------
        place : ConstraintPlace
            Scene in which the constraint acts.

        Returns
        -------
        list of str
            Names such as "least depth of mark 2".
        """
        ends = 2 if np.any(self.depth_error) else 1
        marks = name_marks(select_sights(self, place), place)
        return [f"least depth of {mark}" for mark in marks for _ in range(ends)]

    def stages(self, of: ConstraintInputs) -> ConstraintRows:
        """Add the stages of the rows; return them, in the order of `label`."""
        program, n = of.inputs.program, of.columns.size
        settings = [self.least, self.rate, self.depth_error]
        numbers = concatenate_rows(program, [program.number(each).flat for each in settings])
        each, ends = [], 2 if np.any(self.depth_error) else 1
        for view in select_views(self, of):
            m = ends * view.depth.size
            rows = ConstraintRows(program.rows(m, n), program.rows(m))
            program.add(
                view_barriers.compute_depth_rows,
                points=view.points,
                depth=view.depth,
                hidden=view.hidden,
                J=view.J,
                settings=numbers,
                dt=of.inputs.dt,
                drift=add_camera_drift(of, *view.sight.key),
                ends=ends,
                C=rows.C,
                bound=rows.bound,
            )
            each.append(rows)
        return join_rows(of, each)
