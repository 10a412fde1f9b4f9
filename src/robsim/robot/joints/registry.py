"""The kinds of joint by name: those of RobSim, and those that the user registers."""

from __future__ import annotations

from robsim.base.errors import InputError, suggest
from robsim.declare import family, register
from robsim.robot.joints.car import Car
from robsim.robot.joints.fixed import Fixed
from robsim.robot.joints.floating import Floating
from robsim.robot.joints.kind import JointKind
from robsim.robot.joints.planar import Planar
from robsim.robot.joints.prismatic import Prismatic
from robsim.robot.joints.rail import Rail
from robsim.robot.joints.revolute import Revolute
from robsim.robot.joints.unicycle import Unicycle

JOINTS = family("joint kind")
for _kind in (Fixed, Revolute, Prismatic, Floating, Planar, Unicycle, Car, Rail):
    register("joint kind")(_kind)
KINDS = JOINTS.kinds
SINGLE = tuple(name for name, kind in KINDS.items() if kind().single)  # of one coordinate


def kind_of(given: object) -> JointKind:
    """Return what a joint is told of its kind as a kind: a name, or a kind itself."""
    if isinstance(given, JointKind):
        return given
    if not isinstance(given, str):
        made = f"; write {given.__name__}(...)" if isinstance(given, type) else ""
        raise InputError(
            f"no joint kind {given!r}{made or '; ' + suggest(given, KINDS, 'joint kinds')}"
        )
    kind: type[JointKind] = JOINTS.find(given)
    try:
        return kind()
    except TypeError:  # it has parameters without defaults
        who = kind.__name__
        raise InputError(
            f"joint kind '{given}' has parameters: give the joint {who}(...) instead of the name"
        ) from None
