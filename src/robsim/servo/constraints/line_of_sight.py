"""Constraint: no body comes between a camera and its marks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.declare import DeclaredValue, Length, register
from robsim.declare.texts import FrameReference
from robsim.kernels.control.space_barriers import bound_occlusions
from robsim.servo.constraints.constraint import (
    VIEW,
    BarrierRate,
    ConstraintInputs,
    ConstraintPlace,
    ConstraintRows,
    MarkView,
    RowConstraint,
    join_rows,
)
from robsim.servo.constraints.frame_motion import add_motion_in_camera, check_frames
from robsim.servo.constraints.mark_selection import (
    CameraOfMarks,
    TargetOfMarks,
    name_marks,
    select_sights,
    select_views,
)


@register("constraint", "line_of_sight")
@dataclass(frozen=True)
class LineOfSight(RowConstraint, DeclaredValue):
    """Constraint of the lines of sight: a body stays out of them.

    The body is a sphere about the origin of a frame of a robot or an object, or a capsule about
    the segment between the origins of two frames. The line of sight to a mark is the segment from
    the camera to the mark. With the nearest points a of the line of sight and b of the body,

        h = |b - a| - radius >= 0.

    The zero of h is that of the angle between the rays to the mark and to the centre of a sphere,
    less the angular radius of the sphere (Nicolis, Palumbo, Zanchettin and Rocco, Occlusion-Free
    Visual Servoing for the Shared Autonomy Teleoperation of Dual-Arm Robots, 2018; see also
    arXiv:2309.03476). The distance is in metres, and a body behind a mark or behind the camera
    does not hide it. Camera, target and body may all move.

    Raises
    ------
    InputError
        By `simulate`, if a frame does not exist, or if the task has no such camera or target.

    Notes
    -----
    The positions of the marks are the measured pixels at the believed depths; the body is where
    the controller believes it to be.

    Examples
    --------
    >>> import robsim as rs
    >>> law = rs.laws.ConstrainedLaw([LineOfSight("post", radius=0.05)])
    """

    level: ClassVar[int] = VIEW
    body: Annotated[str, FrameReference, "Frame of the body that must not hide a mark."]
    radius: Annotated[float, Length(above=0.0), "Radius of the body about its segment, in metres."]
    end: Annotated[
        str | None, FrameReference, "Frame at the other end of the body; None: a sphere."
    ] = None
    rate: BarrierRate = 4.0
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
            Names such as "post in the sight of mark 2".
        """
        check_frames("LineOfSight", place, [self.body, self.end or self.body])
        marks = name_marks(select_sights(self, place), place)
        return [f"{self.body} in the sight of {mark}" for mark in marks]

    def stages(self, of: ConstraintInputs) -> ConstraintRows:
        """Add the stages of the rows; return them, in the order of `label`."""
        return join_rows(of, [self._add_sight(of, view) for view in select_views(self, of)])

    def _add_sight(self, of: ConstraintInputs, view: MarkView) -> ConstraintRows:
        """Add the stage of the rows of a camera-target pair; return them."""
        program, (eye, target), N = of.inputs.program, view.sight.key, view.depth.size
        frames = target, self.body, self.end or self.body
        motions = {name: add_motion_in_camera(of, eye, name) for name in dict.fromkeys(frames)}
        each = [motions[name] for name in frames]
        rows = ConstraintRows(program.rows(N, of.columns.size), program.rows(N))
        program.add(
            bound_occlusions,
            points=view.points,
            depths=view.depth,
            hidden=view.hidden,
            start=each[1].T,
            end=each[2].T,
            jacobians=[motion.J for motion in each],
            drifts=[motion.drift for motion in each],
            radius=program.constant(self.radius),
            rate=program.number(self.rate),
            dt=of.inputs.dt,
            **rows._asdict(),
        )
        return rows
