"""Encoders that round the measured coordinates of joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.declare import PerRun, register
from robsim.declare.joint_numbers import (
    OneOrEach,
    broadcast_limits,
    check_joint_count,
    get_coordinate_axes,
)
from robsim.declare.scalars import NOT_NEGATIVE
from robsim.kernels.bodies.actuator_response import quantise_encoders
from robsim.world.imperfections.imperfection import RunFacts, Statement
from robsim.world.imperfections.joint_effect import JointEffect, JointEffectStage, JointRows
from robsim.world.imperfections.rate_limits import PerJointLimit
from robsim.world.scene import Scene

EncoderSteps = Annotated[
    PerJointLimit,
    OneOrEach(get_coordinate_axes, item=NOT_NEGATIVE),
    PerRun((), ("n",)),
    "Rounding step of revolute and prismatic coordinates, in rad or m.",
]


@register("joint effect", "encoder")
@dataclass(frozen=True)
class Encoder(JointEffect):
    """Encoders with a finite step: one step for all coordinates, or one for each.

    A step h adds an error of standard deviation h / sqrt(12).

    Examples
    --------
    >>> Encoder(0.001).encoder
    0.001
    """

    place: ClassVar[JointEffectStage] = JointEffectStage.MEASURED
    title: ClassVar[str] = "coarse encoders"
    left_out: ClassVar[str] = ""
    encoder: EncoderSteps = 0.001

    def check(self, velocities: Sequence[str], coordinates: Sequence[str]) -> None:
        check_joint_count(self.encoder, "encoder", coordinates)

    def add_stages(self, joints: JointRows) -> None:
        steps = joints.program.numbers(self.steps(joints.scene), 1)
        before = joints.measured
        joints.program.add(quantise_encoders, steps=steps, q=before, out=joints.add_measured_rows())

    def steps(self, scene: Scene) -> Array:
        """Return the step (nq,) of each coordinate, zero for joints with several coordinates."""
        rounded = np.isin(np.arange(scene.nq), scene.tree.alone(np.arange(scene.nv)))
        return make_read_only(np.where(rounded, broadcast_limits(self.encoder, scene.nq).T, 0.0).T)

    def deviation(self, scene: Scene) -> Array:
        return self.steps(scene) / math.sqrt(12.0)

    def stated(self, facts: RunFacts) -> Statement:
        step = float(np.max(self.encoder))
        what = f"The encoders count in steps of {step:.3g} (rad or m)"
        return facts.state_final_error(what, step=step)
