"""The command of a controller at an instant, and what it is based on."""

from __future__ import annotations

from typing import Any, NamedTuple

from robsim.base.arrays import Array
from robsim.servo.laws.control_state import ControlState


class Command(NamedTuple):
    """The features at an instant and the command that follows, with the run last."""

    s: Array  # (k, B)
    error: Array  # (k, B)
    qd: Array  # (n, B) of the commanded joints
    task_jacobian: Array  # (k, n, B) L J: how the commanded joints move the features


class LawInput(NamedTuple):
    """What the command of one servo task is based on: error and the state of the law."""

    error: Array  # (k, B)
    state: ControlState  # which the law is given


class Decision(NamedTuple):
    """A command, the Jacobian of its frame, and of a servo task the `basis` of the command.

    `weights` say how much each number of s counts, where a task has a weighting.
    """

    command: Command
    J: Array  # (6, n, B) of its frame: of a camera in its own axes, of another in the world's
    basis: Any = None
    weights: Array | None = None  # (k, B)
