"""The command of a controller at one instant, and its inputs."""

from __future__ import annotations

from typing import Any, NamedTuple

from robsim.base.arrays import Array
from robsim.servo.laws.control_state import ControlState


class Command(NamedTuple):
    """Features at one instant and the resulting command, with the run last."""

    s: Array  # (k, B)
    error: Array  # (k, B)
    qd: Array  # (n, B) of the commanded joints
    task_jacobian: Array  # (k, n, B) L J


class Signals(NamedTuple):
    """The signals of one run at one instant, or at several instants with the time first."""

    s: Array  # (k,)
    error: Array  # (k,)
    qd: Array  # (n,) of the commanded joints
    weights: Array  # (k,) of the components of s, or (0,) without a weighting


class LawInput(NamedTuple):
    """Input of the law of one servo task: the error and the state."""

    error: Array  # (k, B)
    state: ControlState


class Decision(NamedTuple):
    """A command, the Jacobian of its frame, and the input of the law of a servo task.

    `weights` are the weights of the components of s in a task with a weighting.
    """

    command: Command
    J: Array  # (6, n, B) of its frame: in camera axes for a camera, else in world axes
    basis: Any = None  # Any: a `LawInput`, or None for a task without a law
    weights: Array | None = None  # (k, B)
