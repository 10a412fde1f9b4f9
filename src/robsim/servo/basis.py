"""What the command of one servo task is based on."""

from __future__ import annotations

from typing import NamedTuple

from robsim.base.arrays import Array
from robsim.servo.laws.control_state import ControlState


class Basis(NamedTuple):
    """What the command of one servo task is based on: error and the state of the law."""

    error: Array  # (k, B)
    state: ControlState  # which the law is given
