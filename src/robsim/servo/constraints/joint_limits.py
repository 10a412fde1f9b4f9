"""Constraint: joints brake in front of their limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, register
from robsim.declare.joint_numbers import (
    OneOrEach,
    broadcast_limits,
    check_joint_count,
    get_coordinate_axes,
)
from robsim.declare.scalars import NOT_NEGATIVE
from robsim.servo.constraints.constraint import (
    ConstraintPlace,
    JointConstraint,
    VelocityLimits,
    make_velocity_limits,
)
from robsim.world.scene import Scene


@register("constraint", "joint_limits")
@dataclass(frozen=True)
class JointLimits(JointConstraint, DeclaredValue):
    """Constraint of the coordinates of joints: each joint can brake in front of its limits.

    The velocity v of a joint at the distance d from its limit is at most the largest one that lets
    the joint stop within d, with the deceleration of `JointAccelerations` in every period (without
    it, v <= d/dt). A command that respects the bound leaves the next command a bound that it can
    respect, so the constraint never contradicts the acceleration. Joints without limits, and
    velocities that move several coordinates, are free.

    Raises
    ------
    InputError
        By `simulate`, if the number of margins is wrong, or if a margin leaves a joint no range.

    Examples
    --------
    A gantry starts near a joint limit, and the law alone runs into it:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("joint_limits"))
    >>> plain = scenario.at({"task.secondary": None, "task.projection": None})
    >>> for law in "joint", rs.laws.ConstrainedLaw([JointLimits()]):
    ...     print(rs.Outcome(int(plain.at("task.law", law).run().outcome)).name)
    JOINT_LIMIT
    CONVERGED
    """

    margin: Annotated[
        float | Sequence[float],
        OneOrEach(get_coordinate_axes, item=NOT_NEGATIVE),
        "Distance that joints keep from their limits: for all, or for each coordinate.",
    ] = 0.0

    def limits(self, place: ConstraintPlace) -> VelocityLimits:
        """Return the limits of the commanded velocities.

        Parameters
        ----------
        place : ConstraintPlace
            Scene in which the constraint acts.

        Returns
        -------
        VelocityLimits
            Limits of the coordinates, the margin included.
        """
        scene = place.scene
        check_joint_count(self.margin, "margin", scene.coordinate_names)
        margins = broadcast_limits(self.margin, scene.nq)
        check_margin_room(margins, scene)
        at = scene.tree.alone(place.columns)
        low, high = scene.limits[at].T + np.stack([margins[at], -margins[at]])
        low, high = np.where(at >= 0, low, -np.inf), np.where(at >= 0, high, np.inf)
        return make_velocity_limits(len(at), low=low, high=high)


def check_margin_room(margins: np.ndarray, scene: Scene) -> None:
    """Raise InputError unless margins (nq,) leave joints some range between their limits."""
    ranges = np.diff(scene.limits, axis=1)[:, 0]
    tight = np.flatnonzero(2.0 * margins >= ranges)
    if tight.size:
        i = int(tight[0])
        raise InputError(
            f"margin: {margins[i]:g} leaves no room to {scene.coordinate_names[i]}, whose "
            f"limits are {ranges[i]:g} ({scene.coordinate_units[i]}) apart"
        )
