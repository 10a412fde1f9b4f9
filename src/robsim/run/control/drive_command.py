"""The command of a controller on its own, and the state of its health."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple, get_args

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.kernels.control import command_limits

EMPTY = make_read_only(np.empty(0))
Doing = Literal["waiting", "moving", "holding", "stopped", "converged"]
PHASES: tuple[Doing, ...] = get_args(Doing)

LIMITS = {
    command_limits.STOPPED: "stopped by the watchdog",
    command_limits.OLD_IMAGE: "watchdog",
    command_limits.NOT_RELEASED: "not released",
    command_limits.LATE_CALL: "late call",
    command_limits.FEW_MARKS: "too few marks",
    command_limits.NOT_FINITE: "not finite",
    command_limits.SPEED: "speed",
    command_limits.ACCELERATION: "acceleration",
    command_limits.FENCE: "fence",
}


class Health(NamedTuple):
    """State of the images, joints and limits of a controller.

    Attributes
    ----------
    converged : bool
        Whether every error is below its tolerance, no mark is lost, no image is old and the robot
        may move.
    lost : tuple of str
        Marks that are missing in the last image: "plate[2]", or "left: plate[2]" if there are
        several cameras.
    stale : bool
        Whether the images are too old for the watchdog.
    age : float
        Age of the oldest image in use, in seconds. An image without marks is not used. An
        incomplete image is not used if a feature needs all marks.
    limits : tuple of str
        Limits that change the command: "speed", "acceleration", "fence", "joint limit of elbow";
        constraints of the law that hold it back, as "left border for mark 2"; or reasons to hold
        the robot: "watchdog", "stopped by the watchdog", "not released", "late call", "too few
        marks", "not finite".
    unused : tuple of str
        Data of the last call that are not used: names of other or doubtful targets, images that are
        older than the last or were taken in the future.
    fault : str
        Error in the data of the last call, in a sentence; "" if there is none.

    Examples
    --------
    >>> Health().converged, Health().limits
    (False, ())
    """

    converged: bool = False
    lost: tuple[str, ...] = ()
    stale: bool = False
    age: float = 0.0
    limits: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()
    fault: str = ""


class DriveCommand(NamedTuple):
    """Command of a controller for the period that begins.

    Attributes
    ----------
    velocities : ndarray of shape (n,)
        Commanded velocities in rad/s and m/s, in the order of `Controller.velocity_names`; empty if
        the law commands torques.
    error : ndarray of shape (k,)
        Error of the features, in their units; empty while the controller waits.
    phase : {"waiting", "moving", "holding", "stopped", "converged"}
        Activity of the controller. It is "waiting" until all marks have been seen once, "holding"
        while the robot may not move, and "stopped" until a reset.
    health : Health
        State of images, joints and limits.
    torques : ndarray of shape (n,)
        Commanded torques in N m and forces in N, in the same order; empty if the law commands
        velocities. The drive adds the damping of the joints and their gravity. A robot that is held
        gets zero torques.

    See Also
    --------
    Controller.step : Return the command of a period.

    Examples
    --------
    >>> import robsim as rs
    >>> controller = rs.Controller.from_file(rs.examples.path("visp_tutorial"))
    >>> run = controller.experiment.run(duration=0.4)
    >>> command = controller.step(run.pixels.values[0], run.q.values[0], t=0.0)
    >>> command.velocities.shape, command.phase, command.health.lost
    ((6,), 'moving', ())
    """

    velocities: Array
    error: Array
    phase: Doing
    health: Health
    torques: Array = EMPTY

    @property
    def numbers(self) -> Array:
        """The velocities or the torques (n,) that are commanded."""
        return self.torques if self.torques.size else self.velocities


def list_active_limits(why: int, at_limit: Array, names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the limits that change a command, from its bits."""
    limits = [name for bit, name in LIMITS.items() if why & bit]
    if why & command_limits.JOINT_LIMIT:
        pairs = zip(names, at_limit, strict=True)
        limits += [f"joint limit of {name}" for name, there in pairs if there]
    return tuple(limits)


def classify_activity(why: int, converged: bool) -> Doing:
    """Return the activity of a controller, from the bits of its command."""
    if why & command_limits.STOPPED:
        return "stopped"
    if why & command_limits.HELD:
        return "holding"
    return "converged" if converged else "moving"
