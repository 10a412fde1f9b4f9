"""Joints: the motion of a link relative to its parent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

from robsim.base.arrays import Array, as_floats, as_nonnegative, as_positive
from robsim.base.errors import InputError, format_value
from robsim.base.name_check import check_name
from robsim.base.parameter_names import name_parameters
from robsim.base.unit_warnings import warn_of_degrees
from robsim.base.value import replace_unchecked
from robsim.geometry.curves import Curve
from robsim.geometry.pose import IDENTITY, Pose, PoseLike, check_single_pose
from robsim.robot.dh_row import DHRow
from robsim.robot.joints.ackermann import Ackermann, Rolling
from robsim.robot.joints.car import Steering
from robsim.robot.joints.chord import Chord
from robsim.robot.joints.couplings import Coupling
from robsim.robot.joints.joint_kind import JointKind, JointParts, check_joint_kind
from robsim.robot.joints.joint_registry import JOINTS, find_joint_kind, list_single_kinds
from robsim.robot.joints.mimic import Mimic

__all__ = ["Ackermann", "Chord", "Coupling", "Joint", "JointKind", "Mimic", "Rolling", "Steering"]

LIMIT_SLACK = 1e-9  # metres or radians: largest excess over a limit, due to rounding
RESISTANCES = "armature", "damping", "friction"  # numbers that resist the motion of a joint
DH_POSES = ("place", "tail")  # constants of a joint that follow from a DH row
_REQUIRED_PARTS: dict[str, type[Any]] = {"curve": Curve, "steering": Steering}


@name_parameters
@dataclass(frozen=True)
class Joint:
    """Joint between a link and its parent: two constant poses with a motion between them.

    The pose of the link in its parent is

        T = place @ motion(q) @ tail.

    A revolute joint turns about the z axis of its place, and a prismatic joint slides along it. A
    floating joint moves freely, and a planar joint in the plane z = 0. A unicycle and a car move in
    this plane but not sideways. A rail moves along its curve, with x tangent to the curve.

    Parameters
    ----------
    kind : str or JointKind, default "fixed"
        "fixed", "revolute", "prismatic", "floating", "planar", "unicycle", "car" or "rail", or a
        kind that you define as a `JointKind`.
    place : Pose, default the identity
        Pose of the joint in the parent link.
    tail : Pose, default the identity
        Pose of the link in the moved frame of the joint.
    limits : tuple of two float, optional
        Lowest and highest coordinate, in rad or m. Default: no limits, or the ends of a rail.
    name : str, optional
        Name of the joint and of its coordinates. Default: the name of the link.
    speed : float, optional
        Largest speed of the drive, in rad/s or m/s. It is written to files, and simulations do not
        enforce it.
    effort : float, optional
        Largest torque or force of the drive, in N m or N. Simulated drives saturate there.
    armature : float, default 0
        Inertia of the rotor of the drive about the joint, in kg m^2, or kg for a prismatic joint:
        the inertia of the motor times the square of the gear ratio.
    damping : float, default 0
        Coefficient b of viscous friction, in N m s/rad or N s/m.
    friction : float, default 0
        Coulomb friction f, in N m or N. A moving joint has the friction torque
        -b v - f sign(v); a joint at rest moves if the other torques exceed f.
    curve : Curve, optional
        Curve of a rail, required for this kind.
    steering : Steering, optional
        Steering of a car, required for this kind.
    follows : Mimic, Chord, Ackermann or Rolling, optional
        Coupling that makes the coordinate depend on another coordinate.
    dh : DHRow, optional
        Denavit-Hartenberg row that determines `place` and `tail` of a fixed, revolute or prismatic
        joint. Use `with_constants` to change it.

    Raises
    ------
    InputError
        If the parameters do not fit the kind, or contradict each other.

    Examples
    --------
    >>> Joint("prismatic", limits=(0.0, 0.5)).limits
    (0.0, 0.5)
    """

    kind: str | JointKind = "fixed"
    place: Pose = IDENTITY
    tail: Pose = IDENTITY
    limits: tuple[float, float] | None = None
    name: str | None = field(default=None, kw_only=True)
    speed: float | None = field(default=None, kw_only=True)
    effort: float | None = field(default=None, kw_only=True)
    armature: float = field(default=0.0, kw_only=True)
    damping: float = field(default=0.0, kw_only=True)
    friction: float = field(default=0.0, kw_only=True)
    curve: Curve | None = field(default=None, kw_only=True)
    steering: Steering | None = field(default=None, kw_only=True)
    follows: Coupling | None = field(default=None, kw_only=True)
    dh: DHRow | None = field(default=None, kw_only=True)

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            kind: str | JointKind = "fixed",
            place: PoseLike = IDENTITY,
            tail: PoseLike = IDENTITY,
            limits: Sequence[float] | Array | None = None,
            *,
            name: str | None = None,
            speed: float | None = None,
            effort: float | None = None,
            armature: float = 0.0,
            damping: float = 0.0,
            friction: float = 0.0,
            curve: Curve | None = None,
            steering: Steering | None = None,
            follows: Coupling | None = None,
            dh: DHRow | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        self._check_kind()
        for part in ("place", "tail"):
            object.__setattr__(self, part, check_single_pose(getattr(self, part), f"joint {part}"))
        if self.dh is not None:
            self._store_dh_row(self.dh)
        if self.name is not None:
            check_name(self.name, "joint")
        self._check_drive_numbers()
        for part, expected in _REQUIRED_PARTS.items():
            self._check_part(part, expected)
        self._check_follows()
        self._check_limits()

    @cached_property
    def model(self) -> JointKind:
        """Kind of the joint as a `JointKind`."""
        return find_joint_kind(self.kind)

    @property
    def moves(self) -> bool:
        """Whether the joint has a coordinate, independent or coupled."""
        return bool(self.model.coordinates)

    @property
    def is_coupled(self) -> bool:
        """Whether the coordinate is a function of another. The angle of a rolling wheel is not."""
        return self.follows is not None and self.follows.is_coupled

    @cached_property
    def parts(self) -> JointKind | JointParts:
        """Independent coordinates and velocities; none if the coordinate is coupled."""
        if self.follows is None:
            return self.model
        return (
            JointParts()
            if self.is_coupled
            else JointParts(self.model.coordinates, self.model.units)
        )

    @property
    def required_part(self) -> Curve | Steering | None:
        """Curve or steering of the joint, if its kind requires one."""
        part: Curve | Steering | None = None
        if self.model.needs is not None:
            part = getattr(self, self.model.needs)
        return part

    def with_prefix(self, prefix: str) -> Joint:
        """Return the joint for a scene, in which the names of coordinates have a prefix."""
        if self.follows is None or not self.is_coupled:
            return self
        return self.following(f"{prefix}.{self.follows.of}")

    def following(self, name: str) -> Joint:
        """Return a copy that follows the coordinate with this name."""
        assert self.follows is not None
        return replace(self, follows=replace(self.follows, of=name))  # type: ignore[type-var]

    def with_constants(
        self, place: PoseLike = IDENTITY, tail: PoseLike = IDENTITY, dh: DHRow | None = None
    ) -> Joint:
        """Return a copy with other constants: two poses, or a Denavit-Hartenberg row.

        Parameters
        ----------
        place, tail : Pose, default the identity
            Pose of the joint in the parent, and of the link in the moved frame.
        dh : DHRow, optional
            Row that determines both poses.

        Returns
        -------
        Joint
            Copy with these constants in place of the previous constants.

        Examples
        --------
        >>> joint = Joint("revolute", dh=DHRow(theta=0, d=0, a=0.5, alpha=0))
        >>> joint.with_constants(dh=replace(joint.dh, a=0.6)).tail.position
        array([0.6, 0. , 0. ])
        """
        poses = check_single_pose(place, "joint place"), check_single_pose(tail, "joint tail")
        return replace(self, place=poses[0], tail=poses[1], dh=dh)

    def revised(self, **changes: Any) -> Joint:  # Any: values of the fields named
        """Return a copy with other numbers; a new DH row also replaces `place` and `tail`."""
        if "dh" in changes:
            return self.held(**changes)
        if self.dh is not None and changes.keys() & {"place", "tail"}:
            raise InputError("dh and place or tail: give one of the two only")
        return replace(self, **changes)

    def held(self, **changes: Any) -> Joint:  # Any: values of the fields named
        """Return a copy with poses and limits that may differ between runs, without checks."""
        row = changes.get("dh")
        constants = (
            {} if row is None else dict(zip(DH_POSES, row.constants(self.model.turns), strict=True))
        )
        return replace_unchecked(self, **changes, **constants)

    def _store_dh_row(self, row: object) -> None:
        """Store the constants of a DH row; raise InputError for poses that contradict it."""
        if not isinstance(row, DHRow):
            raise InputError(f"joint dh: expected a DHRow, got {format_value(row)}")
        if not self.model.rowed:
            raise InputError(f"a {self.model.name} joint has place and tail, not dh")
        poses = self.place, self.tail
        place, tail = row.constants(self.model.turns)
        if poses not in ((IDENTITY, IDENTITY), (place, tail)):
            raise InputError("dh and place or tail: give one of the two only")
        object.__setattr__(self, "place", place)
        object.__setattr__(self, "tail", tail)

    def _check_drive_numbers(self) -> None:
        """Store the numbers of the drive as floats; raise InputError if one is wrong."""
        for part in ("speed", "effort"):
            if getattr(self, part) is not None:
                object.__setattr__(self, part, as_positive(getattr(self, part), f"joint {part}"))
        for part in RESISTANCES:
            object.__setattr__(self, part, as_nonnegative(getattr(self, part), f"joint {part}"))
        given = [part for part in ("speed", "effort", *RESISTANCES) if getattr(self, part)]
        if given and not self.model.single:
            others = list_single_kinds()
            raise InputError(
                f"a {self.model.name} joint has no {given[0]}; only {others} joints have one"
            )

    def _check_kind(self) -> None:
        """Store a built-in kind by its name, and check a kind of the user."""
        if not self.model.own and JOINTS.get(self.model.name) is type(self.model):
            object.__setattr__(self, "kind", self.model.name)
        else:
            check_joint_kind(self.model)

    def _check_part(self, part: str, expected: type) -> None:
        """Raise InputError unless a part is present exactly if the kind requires it."""
        value, needs = getattr(self, part), self.model.needs == part
        if value is None and needs:
            raise InputError(f"a {self.model.name} joint needs a {part}")
        if value is not None and not needs:
            kind = next(name for name, kind in JOINTS.kinds.items() if kind.needs == part)
            raise InputError(
                f"a {self.model.name} joint has no {part}; only a {kind} joint has one"
            )
        if value is not None and not isinstance(value, expected):
            raise InputError(f"{part}: expected a {expected.__name__}, got {format_value(value)}")

    def _check_follows(self) -> None:
        """Raise InputError unless the coupling suits the kind of the joint."""
        if self.follows is None:
            return
        if not isinstance(self.follows, Coupling):
            raise InputError(
                f"follows: expected Mimic, Chord, ..., got {format_value(self.follows)}"
            )
        if not self.model.follower:
            raise InputError(
                f"a {self.model.name} joint cannot follow others; {list_single_kinds()} can"
            )
        yields = self.follows.yields
        if yields and (yields == "an angle") != self.model.turns:
            what = f"{type(self.follows).__name__} gives {yields}"
            raise InputError(f"{what}, which is no coordinate of a {self.model.name} joint")

    def _check_limits(self) -> None:
        """Store the limits as floats, or the default of the kind; raise InputError if wrong."""
        if self.limits is None:
            if self.follows is None:
                object.__setattr__(self, "limits", self.model.span(self.required_part))
            return
        limits = as_floats(self.limits, "joint limits", (2,))
        if not self.model.single:
            raise InputError(f"a {self.model.name} joint has no limits, got {self.limits}")
        if limits.ndim != 1 or not limits[0] < limits[1]:
            raise InputError(f"joint limits must be (lowest, highest), got {self.limits}")
        if self.follows is not None and not self.follows.limited:
            raise InputError(
                f"limits of a joint that follows by {type(self.follows).__name__} are not checked: "
                f"limit '{self.follows.of}'"
            )
        if self.kind == "revolute":
            warn_of_degrees(self.limits, "joint limits")
        object.__setattr__(self, "limits", tuple(limits.tolist()))


FIXED = Joint()


def list_coordinate_units(joints: Sequence[Joint]) -> tuple[str, ...]:
    """Return the unit "rad", "m" or "1" of each coordinate of the joints."""
    return tuple(unit for joint in joints for unit in joint.parts.units)
