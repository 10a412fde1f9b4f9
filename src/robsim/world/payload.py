"""Loads that a frame of a robot carries for a time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, ListOf, PerRun, Quantity, Table, Time, Vector, described
from robsim.declare.context import FieldValue
from robsim.declare.controls import Control, ControlPlace
from robsim.declare.texts import FrameReference
from robsim.geometry.inertia import Inertia
from robsim.geometry.pose import Pose


@described
@dataclass(frozen=True)
class Payload(DeclaredValue):
    """Load on a frame of a robot, from one time to another.

    The load is a ball of constant density. It acts on the joints that a drive moves, from the first
    control instant after it is attached until the first after it is released. The model of the
    drive includes it only with `DriveModel(payload=True)`. Objects on a robot's frame with a mass
    are loads, too.

    Raises
    ------
    InputError
        Unless the load is released after it is attached.

    Examples
    --------
    >>> import robsim as rs
    >>> load = rs.drives.Payload("ur5e.tool0", mass=2.0, centre=(0, 0, 0.1), attached=1.0)
    >>> float(load.inertia.tensor[0, 0].round(6))
    0.002
    """

    on: Annotated[str, FrameReference, "Frame of the scene that carries the load."]
    mass: Annotated[float, Quantity(least=0, dimension="mass"), PerRun(()), "Mass in kg."]
    centre: Annotated[
        Sequence[float] | Array, Vector("length"), "Centre of mass in the frame, in metres."
    ] = (0.0, 0.0, 0.0)
    radius: Annotated[float, Quantity(least=0, dimension="length"), "Radius of the ball."] = 0.05
    attached: Annotated[float, Time(least=0), "Time from which the frame carries the load."] = 0.0
    released: Annotated[
        float | None, Time(above=0), "Time at which the load is released. None: never."
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.released is not None and self.released <= self.attached:
            raise InputError(
                f"payload on '{self.on}': released at {self.released:g} s, expected a time after "
                f"{self.attached:g} s, at which it is attached"
            )

    def after(self, seconds: float) -> Payload | None:
        """Return the load with the times as some seconds later; None if it is released by then."""
        released = None if self.released is None else self.released - seconds
        if released is not None and released <= 0.0:
            return None
        return replace(self, attached=max(self.attached - seconds, 0.0), released=released)

    @property
    def inertia(self) -> Inertia:
        """Inertia of the load in its frame, for a mass of one number."""
        moment = 0.4 * self.mass * self.radius**2
        return Inertia(self.mass, self.centre, moment * np.eye(3))

    def moments_at(self, offset: Array) -> Array:
        """Return mass, first and second moments (10,) or (10, runs) about the origin of a body.

        `offset` (4, 4) is the pose of the frame in the body.
        """
        c = Pose(offset) @ np.asarray(self.centre)
        tensor = 0.4 * self.radius**2 * np.eye(3) + c @ c * np.eye(3) - np.outer(c, c)
        unit = np.array([1.0, *c, *tensor[np.triu_indices(3)]])
        moments: Array = np.multiply.outer(unit, self.mass)
        return moments


START_MASS = 1.0  # kilograms of a load that a user interface adds


@dataclass(frozen=True)
class PayloadList(ListOf):
    """Declaration of payloads. User interfaces add loads on the last frames of robots."""

    def controls(self, value: FieldValue, place: ControlPlace) -> Iterable[Control]:
        if not place.c.facts.get("driven"):
            return
        robots = place.c.facts["scene"].robots
        frames = [f"{robot.name}.{robot.links[-1].name}" for robot in robots]
        starters = {frame: Payload(frame, START_MASS) for frame in frames}
        on = [each.on for each in value]
        yield place.item_list(value, on, starters, (self.least, self.most))
        yield from super().controls(value, place)


PAYLOADS = PayloadList(Table(Payload), most=64)
