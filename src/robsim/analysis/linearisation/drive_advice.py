"""Predicted effects of drives: the joint that limits the gain, and errors at rest."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from robsim.analysis.explanation.text_format import format_list, format_number, format_offset
from robsim.analysis.linearisation.drive_derivatives import DriveDerivatives
from robsim.analysis.linearisation.driven_loop import DrivenLoop, idealise_joints
from robsim.analysis.linearisation.linear_loop import LinearLoop
from robsim.analysis.linearisation.stability_limit import (
    NOTABLE_RISE,
    find_driven_limit,
    find_loop_limit,
    is_stable,
)
from robsim.base.arrays import Array

MOST_SIGNS = 10  # joints with friction up to which all combinations of signs are compared
NO_PIXELS = 1e-6  # pixels below which an error is rounding


@dataclass(frozen=True)
class RestError:
    """Error of the goal at rest that torques at the joints cause; NaN if the loop is unstable.

    Attributes
    ----------
    pixels : float
        Distance of a mark from its goal in pixels, the root mean square over the marks.
    metres : float
        Distance of the camera from its goal, relative to the target.
    radians : float
        Angle of the camera from its goal, relative to the target.

    Examples
    --------
    >>> RestError(2.5, 1e-3, 0.01).pixels
    2.5
    """

    pixels: float
    metres: float
    radians: float

    def __str__(self) -> str:
        """Return the error in one line."""
        if math.isnan(self.pixels):
            return "unknown: the loop does not come to rest"
        if not self.pixels:
            return "none"
        return (
            f"{format_number(self.pixels)} px at rest, {format_offset(self.metres, self.radians)}"
        )


@dataclass(frozen=True)
class DriveAdvice:
    """Predicted effects of the drives on a loop near its goal.

    Attributes
    ----------
    joint : str
        Joint whose drive limits the gain: if it moved exactly as commanded, the largest gain would
        be the highest. Empty if no single joint limits the gain.
    gain_without : float
        Largest factor of the gains if this joint moved exactly as commanded; NaN without a joint.
    sag : RestError
        Error that the weight causes at rest, where the drives do not hold it.
    friction : RestError
        Largest error at which Coulomb friction may hold the joints; zero if a drive integrates the
        error, which moves the joints in jumps.

    Examples
    --------
    >>> none = RestError(0.0, 0.0, 0.0)
    >>> DriveAdvice("arm.elbow", 2.0, none, none).joint
    'arm.elbow'
    """

    joint: str
    gain_without: float
    sag: RestError
    friction: RestError

    def rows(self) -> list[tuple[str, str]]:
        """Return the lines of the printed advice, each with its head."""
        friction = f"at most {self.friction}" if self.friction.pixels > 0.0 else str(self.friction)
        rows = [("Sag", str(self.sag)), ("Friction", friction)]
        if self.joint:
            without = f"{format_number(self.gain_without)} times the gains"
            text = f"'{self.joint}' limits the gain: without its drive, stable up to {without}"
            rows.insert(0, ("Joint", text))
        return rows


def advise_drives(linear: LinearLoop) -> DriveAdvice | None:
    """Return the effects of the drives of a loop; None without a drive."""
    driven, derivatives = linear.driven, linear.drives
    if driven is None or derivatives is None:
        return None
    joint, factor = find_limiting_joint(linear, driven, derivatives)
    if not is_stable(driven.at(1.0, linear.timing.with_rarer_images)):
        none = RestError(math.nan, math.nan, math.nan)
        return DriveAdvice(joint, factor, none, none)
    sag = measure_rest_error(driven, derivatives.missing_torques[:, None])
    return DriveAdvice(joint, factor, sag, find_friction_error(driven, derivatives))


def find_limiting_joint(
    linear: LinearLoop, driven: DrivenLoop, derivatives: DriveDerivatives
) -> tuple[str, float]:
    """Return the joint that limits the gain, and the largest factor of the gains without it."""
    limit, rates, names = find_loop_limit(linear), linear.gain_dependence.rates, []
    for j, name in enumerate(derivatives.joints.names):
        ideal = idealise_joints(driven, derivatives, [j])
        names.append((find_driven_limit(ideal, linear.timing, rates), name))
    factor, name = max(names)
    return (name, factor) if factor > NOTABLE_RISE * limit else ("", math.nan)


def measure_rest_error(driven: DrivenLoop, torques: Array) -> RestError:
    """Return the largest error at rest for held torques (m, cases) at the joints."""
    try:
        motions = driven.basis @ driven.find_rest(torques)
    except np.linalg.LinAlgError:  # a loop that rests nowhere
        return RestError(math.nan, math.nan, math.nan)
    response = driven.response
    marks, place, turn = (A @ motions for A in (response.marks, response.place, response.turn))
    pixels = np.sqrt((marks**2).sum(axis=0) * 2.0 / len(marks))
    i = int(np.argmax(pixels))
    if pixels[i] < NO_PIXELS:
        return RestError(0.0, 0.0, 0.0)
    lengths = (float(np.linalg.norm(each[:, i])) for each in (place, turn))
    return RestError(float(pixels[i]), *lengths)


def find_friction_error(driven: DrivenLoop, derivatives: DriveDerivatives) -> RestError:
    """Return the largest error at which friction may hold the joints.

    A joint rests while the torque of its drive is below its Coulomb friction. The signs of the
    joints are those with the largest error; of many joints each acts alone.
    """
    friction = derivatives.uncompensated_friction
    acting = np.flatnonzero(friction)
    if not acting.size:
        return RestError(0.0, 0.0, 0.0)
    if acting.size > MOST_SIGNS:
        return measure_rest_error(driven, np.diag(friction))
    signs = np.array([(1.0, *rest) for rest in product((1.0, -1.0), repeat=acting.size - 1)]).T
    torques = np.zeros((len(friction), signs.shape[1]))
    torques[acting] = signs * friction[acting, None]
    return measure_rest_error(driven, torques)


def generate_drive_caveats(linear: LinearLoop) -> Iterator[str]:
    """Yield the properties of drives that the linear loop neglects."""
    if linear.drives is None:
        return
    joints = linear.drives.true_joints
    names, friction = joints.names, joints.numbers("friction")
    rough = [f"'{name}'" for name, each in zip(names, friction, strict=True) if each]
    if rough:
        yield (
            f"the Coulomb friction of {format_list(rough)} is not considered in the largest gain"
        )
    limits, loads = joints.limits, np.abs(linear.drives.loads)
    if np.isfinite(limits).any():
        j = int(np.argmax(loads / limits))
        share = format_number(100.0 * float(loads[j] / limits[j]))
        yield (
            "limits of torques are not considered, and the largest gain is lower if they act; at "
            f"rest the weight needs {share} % of the limit of '{names[j]}'"
        )
