"""Prescribed motions of robots: a conveyor, a turning target, a second robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError, format_value, suggest_names
from robsim.base.value import Value
from robsim.declare import described
from robsim.declare.context import Context
from robsim.declare.joint_numbers import Axes, PerJoint
from robsim.declare.texts import FrameReference


def _velocity_axes(c: Context) -> Axes | None:
    """Return the velocity axes of the robot that a motion names, from the parts of the scene."""
    robots, name = c.facts["parts"].get("robots"), c.facts["own"].get("robot")
    if robots is None or name is None:
        return None
    known = {robot.name: robot for robot in robots}
    if name not in known:
        raise InputError(f"no robot '{name}' to move; {suggest_names(name, known, 'robots')}")
    return Axes(known[name].velocity_units, known[name].velocity_names)


@described
@dataclass(frozen=True, eq=False)
class Motion(Value):
    """Prescribed velocities of a robot that no task commands.

    Use a motion for a target that moves, such as a conveyor, a turntable or a second robot. The
    velocities are held constant during a control period.

    Raises
    ------
    InputError
        If constant velocities do not have the shape (nv,).

    Examples
    --------
    >>> Motion("turntable", [0.2]).at(1.5)
    array([0.2])
    """

    robot: Annotated[str, FrameReference, "Name of the robot that moves."]
    rates: Annotated[
        Array | Callable[[float], ArrayLike],
        PerJoint(_velocity_axes, "/s"),
        "Velocities (nv,) of the robot in m/s and rad/s: constant, or a function of the time in "
        "seconds.",
    ]

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(self, robot: str, rates: ArrayLike | Callable[[float], ArrayLike]) -> None: ...

    def __post_init__(self) -> None:
        if not isinstance(self.robot, str):
            raise InputError(f"a motion needs the name of a robot, got {format_value(self.robot)}")
        if not callable(self.rates):
            rates = as_floats(self.rates, f"rates of '{self.robot}'", ("nv",))
            if rates.ndim != 1:
                raise InputError(
                    f"rates of '{self.robot}': expected shape (nv,) or a function of time, "
                    f"got {rates.shape}"
                )
            object.__setattr__(self, "rates", make_read_only(rates))

    @property
    def name(self) -> str:
        """The name of the robot."""
        return self.robot

    def at(self, seconds: float) -> Array:
        """Return the velocities (nv,) at a time in seconds."""
        if callable(self.rates):
            return as_floats(self.rates(seconds), f"rates of '{self.robot}'", ("nv",))
        return self.rates

    def check(self, nv: int, seconds: float = 0.0) -> Array:
        """Return the velocities (nv,) at a time; raise InputError unless there are `nv` of them."""
        rates = self.at(seconds)
        if rates.shape != (nv,):
            raise InputError(f"rates of '{self.robot}': expected ({nv},), got {rates.shape}")
        return rates
