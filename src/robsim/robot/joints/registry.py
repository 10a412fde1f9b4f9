"""The kinds of joint by name: those of RobSim, and those that the user registers."""

from __future__ import annotations

from typing import Any, TypeVar

from robsim.base.errors import InputError, suggest
from robsim.base.names import checked_name
from robsim.robot.joints.car import Car
from robsim.robot.joints.fixed import Fixed
from robsim.robot.joints.floating import Floating
from robsim.robot.joints.kind import JointKind
from robsim.robot.joints.planar import Planar
from robsim.robot.joints.prismatic import Prismatic
from robsim.robot.joints.rail import Rail
from robsim.robot.joints.revolute import Revolute
from robsim.robot.joints.unicycle import Unicycle

K = TypeVar("K", bound=type[JointKind])


class Kinds(dict[Any, type[JointKind]]):
    """Classes of joint kinds by name; InputError for a name that is not there."""

    def __missing__(self, name: object) -> type[JointKind]:
        raise InputError(f"no joint kind {name!r}; {suggest(name, self, 'kinds')}")


_BUILT_IN = Fixed, Revolute, Prismatic, Floating, Planar, Unicycle, Car, Rail
KINDS = Kinds({kind.name: kind for kind in _BUILT_IN})
SINGLE = tuple(kind.name for kind in _BUILT_IN if kind().single)  # of one coordinate


def register_joint(kind: K) -> K:
    """Let a kind of joint of your own be found by its name, as in scenario files; a decorator.

    Registered again, as in a notebook, a name means the latest class. InputError: the name is
    that of a kind of RobSim, or none.
    """
    if not isinstance(kind, type) or not issubclass(kind, JointKind):
        raise InputError(f"register_joint: expected a class of JointKind, got {kind!r:.80}")
    if checked_name(kind.name, "joint kind") in (each.name for each in _BUILT_IN):
        raise InputError(f"joint kind '{kind.name}' is one of RobSim; choose another name")
    KINDS[kind.name] = kind
    return kind


def kind_of(given: object) -> JointKind:
    """Return what a joint is told of its kind as a kind: a name, or a kind itself."""
    if isinstance(given, JointKind):
        return given
    if not isinstance(given, str):
        made = f"; write {given.__name__}(...)" if isinstance(given, type) else ""
        raise InputError(f"no joint kind {given!r}{made or '; ' + suggest(given, KINDS, 'kinds')}")
    kind = KINDS[given]
    try:
        return kind()
    except TypeError:  # it has parameters without defaults
        who = kind.__name__
        raise InputError(
            f"joint kind '{given}' has parameters: give the joint {who}(...) instead of the name"
        ) from None
