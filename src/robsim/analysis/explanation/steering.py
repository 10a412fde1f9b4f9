"""Cars that cannot turn as sharply as their law commands."""

from __future__ import annotations

import numpy as np

from robsim.analysis.explanation.finding import Finding
from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.wording import degrees, length, number
from robsim.robot.joint import Steering

AT_THE_LIMIT = 0.999  # of the largest angle


def steering(inquiry: Inquiry) -> Finding | None:
    """Report a car that is to turn while it stands, or beyond its steering limit."""
    last, tree = inquiry.snapshots[-1], inquiry.case.scene.tree
    for row, velocity, steering in tree.cars:
        name = inquiry.case.scene.coordinate_names[row]
        speed, turn = (float(rate) for rate in last.qd[velocity : velocity + 2, 0])
        if inquiry.falls or turn == 0.0:
            continue
        if speed == 0.0:
            return _standing(name, turn)
        asked = float(np.arctan(steering.wheelbase * turn / speed))
        beyond = abs(asked) > steering.limit * (1 + 1e-9)
        if beyond and last.q[row, 0] * np.sign(asked) > AT_THE_LIMIT * steering.limit:
            return _at_the_limit(name, steering, abs(asked))
    return None


def _standing(name: str, turn: float) -> Finding:
    sentence = (
        f"The law asks for {number(turn)} rad/s of a car that stands: however '{name}' is, only a "
        "car that drives can turn."
    )
    return Finding("standing car", sentence, {"turn_rad_s": turn})


def _at_the_limit(name: str, steering: Steering, asked: float) -> Finding:
    radius = steering.wheelbase / float(np.tan(steering.limit))
    sentence = (
        f"'{name}' is at its limit of {degrees(steering.limit)}, and the law asks for "
        f"{degrees(asked)}: the car drives no circle smaller than {length(radius)} in radius. Let "
        "the way ahead take longer than the turn, by a larger gain of what turns it, or start "
        "farther away."
    )
    evidence = {"limit_rad": steering.limit, "asked_rad": asked, "radius_m": radius}
    return Finding("steering limit", sentence, evidence)
