"""Cars that cannot turn as sharply as their law asks."""

from __future__ import annotations

import numpy as np

from robsim.analysis.explanation.finding import Finding
from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.wording import degrees, length

AT_THE_LIMIT = 0.999  # of the largest angle


def steering_limit(inquiry: Inquiry) -> Finding | None:
    """A car that ends with its steering at the limit, and is to turn more."""
    moment, scene = inquiry.again.moments[-1], inquiry.case.scene
    for row, velocity, steering in scene.tree.cars:
        angle, (v, omega) = float(moment.q[row, 0]), moment.qd[velocity : velocity + 2, 0]
        wanted = float(np.arctan2(steering.wheelbase * omega * np.sign(v), abs(v)))
        if inquiry.falls or not abs(wanted) > steering.limit * (1 + 1e-9):
            continue
        if angle * np.sign(wanted) < AT_THE_LIMIT * steering.limit:
            continue
        radius = steering.wheelbase / np.tan(steering.limit)
        sentence = (
            f"'{scene.coordinate_names[row]}' is at its limit of {degrees(steering.limit)}, and "
            f"the law asks for {degrees(abs(wanted))}: the car drives no circle smaller than "
            f"{length(radius)} in radius. Let the way ahead take longer than the turn, by a larger "
            "gain of what turns it, or start farther away."
        )
        evidence = {"limit_rad": steering.limit, "asked_rad": abs(wanted), "radius_m": radius}
        return Finding("steering limit", sentence, evidence)
    return None
