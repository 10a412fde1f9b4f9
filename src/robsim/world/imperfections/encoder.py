"""Encoders that measure the coordinates of joints in whole steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.base.arrays import Array, frozen
from robsim.declare import Stacked, register
from robsim.declare.joints import OneOrEach, check_count, coordinates, limits_of
from robsim.declare.scalars import NOT_NEGATIVE
from robsim.kernels.bodies.actuation import count
from robsim.world.imperfections.imperfection import RunFacts, Statement
from robsim.world.imperfections.joint_effect import JointEffect, JointPlace, JointRows
from robsim.world.imperfections.rate_limits import Each
from robsim.world.scene import Scene

Steps = Annotated[
    Each,
    OneOrEach(coordinates, item=NOT_NEGATIVE),
    Stacked((), ("n",)),
    "Step in which revolute and prismatic coordinates are measured.",
]


@register("joint effect", "encoder")
@dataclass(frozen=True)
class Encoder(JointEffect):
    """Encoders with a finite step, of one size or one for each coordinate.

    >>> Encoder(0.001).encoder
    0.001
    """

    place: ClassVar[JointPlace] = JointPlace.MEASURED
    title: ClassVar[str] = "coarse encoders"
    left_out: ClassVar[str] = ""
    encoder: Steps = 0.001

    def check(self, velocities: Sequence[str], coordinates: Sequence[str]) -> None:
        check_count(self.encoder, "encoder", coordinates)

    def add_stages(self, joints: JointRows) -> None:
        steps = joints.program.numbers(self.steps(joints.scene), 1)
        before = joints.measured
        joints.program.add(count, steps=steps, q=before, out=joints.new_measured())

    def steps(self, scene: Scene) -> Array:
        """Return the step of each coordinate (nq,); zero for joints without an encoder."""
        counted = np.isin(np.arange(scene.nq), scene.tree.alone(np.arange(scene.nv)))
        return frozen(np.where(counted, limits_of(self.encoder, scene.nq).T, 0.0).T)

    def deviation(self, scene: Scene) -> Array:
        return self.steps(scene) / math.sqrt(12.0)

    def stated(self, facts: RunFacts) -> Statement:
        step = float(np.max(self.encoder))
        what = f"The encoders count in steps of {step:.3g} (rad or m)"
        return facts.lasting(what, step=step)
