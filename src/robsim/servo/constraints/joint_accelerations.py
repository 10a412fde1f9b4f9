"""Constraint: the change of each velocity per second stays below a limit."""

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


@register("constraint", "joint_accelerations")
@dataclass(frozen=True)
class JointAccelerations(JointConstraint, DeclaredValue):
    """Constraint of the change of each velocity per second, also when the joint brakes.

    It never yields: if the bounds of another joint constraint cannot be reached within it, the
    velocity is the nearest one that can.

    Raises
    ------
    InputError
        By `simulate`, if the number of limits is wrong.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import numpy as np
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> law = rs.laws.ConstrainedLaw([JointAccelerations(2.0)])
    >>> run = replace(scenario, task=replace(scenario.task, law=law)).run()
    >>> change = np.diff(run.qd.values, axis=0) / float(run.time[1])
    >>> f"{np.nanmax(abs(change)):.1f}"
    '2.0'
    """

    starting_values: ClassVar[dict[str, float]] = {"most": 5.0}
    most: Annotated[
        float | Sequence[float],
        OneOrEach(get_velocity_axes, "/s^2"),
        "Largest acceleration, in rad/s^2 or m/s^2: for all velocities of the scene, or for each.",
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
            Limits of the accelerations.
        """
        check_joint_count(self.most, "most", place.scene.velocity_names)
        most = broadcast_limits(self.most, place.scene.nv)[place.columns]
        return make_velocity_limits(len(most), accelerations=most)
