"""Constraint: the speed of each joint stays below a limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.declare import DeclaredValue, register
from robsim.declare.joint_numbers import (
    OneOrEach,
    broadcast_limits,
    check_joint_count,
    get_velocity_axes,
)
from robsim.servo.constraints.constraint import (
    ConstraintPlace,
    JointConstraint,
    VelocityLimits,
    make_velocity_limits,
)


@register("constraint", "joint_speeds")
@dataclass(frozen=True)
class JointSpeeds(JointConstraint, DeclaredValue):
    """Constraint of the velocities: each is at most `most`.

    `SpeedLimit` and `Safety.speed` scale the whole command; the constraint lets the other joints
    take over the motion of a joint at its limit.

    Raises
    ------
    InputError
        By `simulate`, if the number of limits is wrong.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> law = rs.laws.ConstrainedLaw([JointSpeeds(0.2)])
    >>> run = replace(scenario, task=replace(scenario.task, law=law)).run()
    >>> f"{float(abs(run.qd).max()):.1f}"
    '0.2'
    """

    starting_values: ClassVar[dict[str, float]] = {"most": 1.0}
    most: Annotated[
        float | Sequence[float],
        OneOrEach(get_velocity_axes, "/s"),
        "Largest speed, in rad/s or m/s: for all velocities of the scene, or for each.",
    ]

    def limits(self, place: ConstraintPlace) -> VelocityLimits:
        """Return the limits of the commanded velocities.

        Parameters
        ----------
        place : ConstraintPlace
            Scene in which the constraint acts.

        Returns
        -------
        VelocityLimits
            Limits of the speeds.
        """
        check_joint_count(self.most, "most", place.scene.velocity_names)
        speeds = broadcast_limits(self.most, place.scene.nv)[place.columns]
        return make_velocity_limits(len(speeds), speeds=speeds)
