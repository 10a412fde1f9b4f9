"""Constraint: two bodies keep a distance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, Length, register
from robsim.declare.texts import FrameReference
from robsim.kernels.control.space_barriers import bound_clearance
from robsim.servo.constraints.constraint import (
    BarrierRate,
    ConstraintInputs,
    ConstraintPlace,
    ConstraintRows,
    RowConstraint,
)
from robsim.servo.constraints.frame_motion import (
    add_motion_in_world,
    check_frames,
    is_moved_relative,
)


@register("constraint", "clearance")
@dataclass(frozen=True)
class Clearance(RowConstraint, DeclaredValue):
    """Constraint of the distance between two bodies: points, spheres or capsules.

    A body is the origin of a frame of a robot, an object or a camera, or the segment between the
    origins of two frames, such as a link between its joints. With the nearest points a and b of
    the two segments,

        h = |b - a| - first_radius - second_radius - distance >= 0.

    The derivative of |b - a| is that of the distance of the points a and b fixed in their bodies,
    as both are nearest (Danskin's theorem). A user covers a robot by several of these constraints;
    the shapes of links are not read.

    Raises
    ------
    InputError
        By `simulate`, if a frame does not exist, or if no commanded joint moves one body relative
        to the other.

    Notes
    -----
    If the segments of two capsules become parallel, the nearest points jump, and the derivative
    with them. If the bodies meet in one point, the row separates them along z of the world.

    Examples
    --------
    >>> import robsim as rs
    >>> keep = Clearance("free_camera.body", "post", distance=0.1, second_radius=0.05)
    >>> law = rs.laws.ConstrainedLaw([keep])
    """

    first: Annotated[str, FrameReference, "Frame of the first body."]
    second: Annotated[str, FrameReference, "Frame of the second body."]
    distance: Annotated[
        float, Length(least=0.0), "Least distance between the surfaces of the bodies, in metres."
    ]
    first_radius: Annotated[float, Length(least=0.0), "Radius of the first body, in metres."] = 0.0
    second_radius: Annotated[float, Length(least=0.0), "Radius of the second body, in metres."] = (
        0.0
    )
    first_end: Annotated[
        str | None, FrameReference, "Frame at the other end of the first body; None: a sphere."
    ] = None
    second_end: Annotated[
        str | None, FrameReference, "Frame at the other end of the second body; None: a sphere."
    ] = None
    rate: BarrierRate = 4.0

    @property
    def _ends(self) -> tuple[str, str, str, str]:
        """Frames at the ends of the first body, and then of the second."""
        return (
            self.first,
            self.first_end or self.first,
            self.second,
            self.second_end or self.second,
        )

    def label(self, place: ConstraintPlace) -> list[str]:
        """Return the name of the row.

        Parameters
        ----------
        place : ConstraintPlace
            Scene in which the constraint acts.

        Returns
        -------
        list of str
            A name such as "distance of panda.flange from post".
        """
        check_frames("Clearance", place, list(self._ends))
        own, other = self._ends[:2], self._ends[2:]
        if not any(is_moved_relative(place, a, b) for a in own for b in other):
            raise InputError(
                f"Clearance: no commanded joint moves '{self.first}' relative to '{self.second}'"
            )
        return [f"distance of {self.first} from {self.second}"]

    def stages(self, of: ConstraintInputs) -> ConstraintRows:
        """Add the stage of the row; return it."""
        program = of.inputs.program
        motions = {name: add_motion_in_world(of, name) for name in dict.fromkeys(self._ends)}
        ends = [motions[name] for name in self._ends]
        rows = ConstraintRows(program.rows(1, of.columns.size), program.rows(1))
        program.add(
            bound_clearance,
            poses=[each.T for each in ends],
            jacobians=[each.J for each in ends],
            drifts=[each.drift for each in ends],
            least=program.constant(self.distance + self.first_radius + self.second_radius),
            rate=program.number(self.rate),
            dt=of.inputs.dt,
            **rows._asdict(),
        )
        return rows
