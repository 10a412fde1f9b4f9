"""The command of a controller at an instant."""

from __future__ import annotations

from typing import NamedTuple

from robsim.base.arrays import Array


class Command(NamedTuple):
    """The features at an instant and the command that follows, with the run last."""

    s: Array  # (k, B)
    error: Array  # (k, B)
    qd: Array  # (n, B) of the commanded joints
    task_jacobian: Array  # (k, n, B) L J: how the commanded joints move the features
