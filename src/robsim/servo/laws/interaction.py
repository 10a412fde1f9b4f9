"""The choice of the interaction matrix of a task."""

from __future__ import annotations

from typing import Literal, get_args

from robsim.declare import Choice
from robsim.declare.arrays import Numbers
from robsim.servo.laws.broyden import RULES

Interaction = Literal["current", "desired", "mean"]  # in the order of the kernels
INTERACTION = Choice(
    RULES,
    beside_of={"broyden_start": ("broyden", "start")},
    plain=get_args(Interaction),
    other=Numbers(shape=("k", 6)),
)
