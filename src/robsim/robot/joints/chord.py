"""Coordinates of a body that hangs from a rail by two wheels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from robsim.base.errors import InputError
from robsim.declare import Length, Word, check_fields, register
from robsim.geometry.curves import Curve
from robsim.kernels.bodies import forward_kinematics
from robsim.kernels.machine.block_rows import BlockRows
from robsim.robot.joints.couplings import CoordinateType, Coupling, SourceJoint, SourceName
from robsim.robot.joints.joint_kind import KinematicsRows

CHORD_QUANTITIES = ("angle", "arc", "height", "tilt")  # in the order of the codes of the kernel


@register("coupling", "chord")
@dataclass(frozen=True)
class Chord(Coupling):
    """Coordinate of a body that hangs from a rail by two wheels.

    The first wheel touches the curve of the rail joint `of` at its coordinate s. Its centre is at
    the distance `radius` from the curve, to the left of the direction of travel. The centre of the
    second wheel is at the same distance from the curve and `length` from the first centre, further
    along the curve. A third wheel may touch the curve between them, at the distance `at` along the
    chord; by default it is the second wheel. The coordinate is one of

    - "angle": angle from the tangent at the first wheel to the chord (rad)
    - "arc": arc length s of the contact point of the third wheel (m)
    - "height": height of the centre of the third wheel above the chord (m)
    - "tilt": angle from the chord to the tangent at the third wheel (rad)

    Raises
    ------
    InputError
        If `at` exceeds the length of the chord.

    Examples
    --------
    >>> Chord("rear", 0.4, gives="angle").at
    0.4
    """

    limited = False
    on_a_curve = True
    wanted = "a rail that follows no other coordinate"
    of: SourceName
    length: Annotated[float, Length(above=0), "Distance between the centres of the two wheels."]
    radius: Annotated[
        float, Length(), "Radius of the wheels, with their centres to the left of the curve."
    ] = 0.0
    at: Annotated[
        float | None,
        Length(above=0),
        "Distance of the third wheel along the chord. None: at its end.",
    ] = None
    gives: Annotated[
        Literal["angle", "arc", "height", "tilt"],
        Word(CHORD_QUANTITIES),
        "Quantity of the coordinate.",
    ] = "arc"

    def __post_init__(self) -> None:
        check_fields(self)
        if self.at is None:
            object.__setattr__(self, "at", self.length)
        elif self.at > self.length:
            raise InputError(
                f"chord at must not exceed its length {self.length:g}, got {self.at:g}"
            )

    @property
    def yields(self) -> CoordinateType:
        """Type of the coordinate: an angle or a length."""
        return "an angle" if self.gives in ("angle", "tilt") else "a length"

    @property
    def relation(self) -> str:
        """Quantity and length of the chord, for overviews."""
        return f"{self.gives} of the chord of {self.length:g} m from {self.of}"

    def fits(self, source: SourceJoint, steers: bool) -> bool:
        """Return whether the source is a rail that follows no other coordinate."""
        return source.model.needs == "curve" and source.follows is None

    @property
    def constants(self) -> tuple[float, float, float]:
        """Length, radius, and position of the third wheel, in metres."""
        assert self.at is not None  # set in __post_init__
        return self.length, self.radius, self.at

    def add_stages(self, tree: KinematicsRows, which: int, **rows: BlockRows) -> None:
        """Add the stage that computes the coordinate on the curve number `which`."""
        what = CHORD_QUANTITIES.index(self.gives)
        tree.program.add(
            forward_kinematics.evaluate_chord, **tree.curves, **rows, which=which, what=what
        )

    def check(self, name: str, curve: Curve) -> None:
        """Raise InputError if a wheel does not fit a bend, or the chord does not fit the curve.

        The centres of wheels beside a circle of curvature k are on a circle of radius |1/k -
        radius|. On half a circle or more, a chord as long as the diameter would jump from one side
        to the other.
        """
        sharpest = max(curve.bends, key=lambda k: k * self.radius)
        if sharpest * self.radius >= 1.0:
            raise InputError(
                f"'{name}': a wheel of radius {abs(self.radius):g} m does not fit into a bend of "
                f"radius {1 / abs(sharpest):g} m"
            )
        k, turn = curve.pieces[:, 4], curve.pieces[:, 4] * curve.spans
        short = (np.abs(turn) >= np.pi) & (2.0 * (1.0 - self.radius * k) <= self.length * np.abs(k))
        if short.any():
            raise InputError(
                f"'{name}': a chord of {self.length:g} m does not fit on a circle of radius "
                f"{1 / np.abs(k[short]).max():g} m"
            )
