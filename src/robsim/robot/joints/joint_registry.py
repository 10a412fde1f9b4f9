"""Kinds of joint by name: built-in kinds and kinds of the user."""

from __future__ import annotations

from robsim.base.errors import InputError, suggest_names
from robsim.declare import family
from robsim.robot.joints.joint_kind import JointKind

JOINTS = family("joint kind")


def list_single_kinds() -> str:
    """Return the names of the kinds with one coordinate, for messages."""
    return ", ".join(name for name, kind in JOINTS.kinds.items() if make_bare_kind(kind).single)


def make_bare_kind(kind: type[JointKind]) -> JointKind:
    """Return an instance of a kind without its parameters, to read its units."""
    return kind.__new__(kind)


def find_joint_kind(value: object) -> JointKind:
    """Return the kind of a joint from its name, or from a kind itself."""
    if isinstance(value, JointKind):
        return value
    if not isinstance(value, str):
        advice = f"; write {value.__name__}(...)" if isinstance(value, type) else ""
        hint = advice or "; " + suggest_names(value, JOINTS.names, "joint kinds")
        raise InputError(f"no joint kind {value!r}{hint}")
    kind: type[JointKind] = JOINTS.find(value)
    try:
        return kind()
    except TypeError:  # the kind has parameters without defaults
        who = kind.__name__
        raise InputError(
            f"joint kind '{value}' has parameters: give the joint {who}(...) instead of the name"
        ) from None
