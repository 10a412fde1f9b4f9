"""Constraints on the command of a law, and the rows that they read and write.

A constraint is linear in the commanded velocities qdot. Constraints of joints bound each velocity;
all others are barriers: a quantity h >= 0, such as the distance of a mark from the border of the
image, must not fall faster than dh/dt = -rate h (Ames et al., "Control barrier functions: theory
and applications", European Control Conference 2019, eq. 6). In a loop with the period dt the rate
is at most 1/dt, which lets h reach 0 in one period.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.declare import Number, PerRun, family
from robsim.features.feature_rows import concatenate_rows
from robsim.kernels.machine.block_rows import BlockRows
from robsim.robot.fk_stages import FKStages
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.servo.controller_rows import ControllerInputs
from robsim.world.scene import Scene

CONSTRAINTS = family("constraint")
HARD, SPACE, VIEW = 0, 1, 2  # levels: if no command satisfies all rows, the highest level yields
BarrierRate = Annotated[
    float,
    Number(above=0, unit="1/s"),
    PerRun(()),
    "Largest relative rate at which the distance to the constraint may fall, in 1/s.",
]


class MarkView(NamedTuple):
    """Rows of the N marks of a camera-target pair, as the controller believes them."""

    sight: CameraTarget  # believed
    pixels: BlockRows  # (N, 2) measured
    points: BlockRows  # (N, 2) normalised
    depth: BlockRows  # (N,)
    J: BlockRows  # (6, n) of the camera relative to its target
    hidden: BlockRows | None  # (N,) 1 for a hidden mark


@dataclass(frozen=True)
class ConstraintInputs:
    """Rows that a constraint reads, with the believed scene.

    Attributes
    ----------
    inputs : ControllerInputs
        Program, period, and measured coordinates.
    scene : Scene
        Scene as the controller models it.
    columns : ndarray of int
        Indices of the n commanded velocities.
    placed : FKStages
        Believed bodies at the measured coordinates.
    views : mapping of PairKey to MarkView
        Marks of each camera-target pair of the task.
    wish : BlockRows of shape (n,)
        Command of the law without constraints.
    past : BlockRows of shape (periods, n)
        Last commands, the newest first.
    """

    inputs: ControllerInputs
    scene: Scene
    columns: NDArray[np.int64]
    placed: FKStages
    views: Mapping[PairKey, MarkView]
    wish: BlockRows
    past: BlockRows


class ConstraintRows(NamedTuple):
    """Rows of m inequalities C qdot >= bound; a bound of -inf is no constraint."""

    C: BlockRows  # (m, n)
    bound: BlockRows  # (m,)


def join_rows(of: ConstraintInputs, each: Sequence[ConstraintRows]) -> ConstraintRows:
    """Return the rows of several constraints in sequence."""
    program = of.inputs.program
    C, bounds = (concatenate_rows(program, part) for part in zip(*each, strict=True))
    return ConstraintRows(C, bounds)


@dataclass(frozen=True)
class ConstraintPlace:
    """Scene in which a constraint acts, before a program exists.

    Attributes
    ----------
    scene : Scene
        Scene as the controller models it.
    sights : tuple of CameraTarget
        Believed camera-target pairs of the task.
    columns : ndarray of int
        Indices of the commanded velocities.
    """

    scene: Scene
    sights: tuple[CameraTarget, ...]
    columns: NDArray[np.int64]


@runtime_checkable
class Constraint(Protocol):
    """Protocol of a constraint: `label` names its rows in a scene, or raises InputError."""

    def label(self, place: ConstraintPlace) -> list[str]:
        """Return the names of the rows of the constraint.

        Parameters
        ----------
        place : ConstraintPlace
            Scene in which the constraint acts.

        Returns
        -------
        list of str
            Names, one for each row.
        """


class RowConstraint(ABC):
    """Base of constraints with rows C qdot >= bound."""

    level: ClassVar[int] = SPACE

    @abstractmethod
    def label(self, place: ConstraintPlace) -> list[str]:
        """Return the names of the rows; raise InputError unless the constraint fits the scene."""

    @abstractmethod
    def stages(self, of: ConstraintInputs) -> ConstraintRows:
        """Add the stages of the rows; return them, in the order of `label`."""


class VelocityLimits(NamedTuple):
    """Limits of the n commanded velocities; infinity without a limit."""

    speeds: Array  # (n,)
    accelerations: Array  # (n,)
    low: Array  # (n,) lowest coordinates
    high: Array  # (n,) highest coordinates


class JointConstraint(ABC):
    """Base of constraints that bound each velocity alone; they always hold."""

    def label(self, place: ConstraintPlace) -> list[str]:
        """Return no names: all joint constraints together bound the velocities."""
        self.limits(place)
        return []

    @abstractmethod
    def limits(self, place: ConstraintPlace) -> VelocityLimits:
        """Return the limits of the commanded velocities.

        Parameters
        ----------
        place : ConstraintPlace
            Scene in which the constraint acts.

        Returns
        -------
        VelocityLimits
            Limits, infinite if the constraint does not set them.
        """


def make_velocity_limits(n: int, **limits: Any) -> VelocityLimits:
    """Return limits of n velocities, infinite unless they are given."""
    most = np.full(n, np.inf)
    return VelocityLimits(
        **{"speeds": most, "accelerations": most, "low": -most, "high": most, **limits}
    )
