"""The joints by which one frame moves against another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from robsim.base.arrays import as_floats, as_positive
from robsim.base.errors import InputError, format_value
from robsim.base.name_check import check_name
from robsim.base.unit_warnings import warn_of_degrees
from robsim.base.value import replace_unchecked
from robsim.geometry.curves import Curve
from robsim.geometry.pose import IDENTITY, Pose, check_single_pose
from robsim.robot.dh_row import DHRow
from robsim.robot.joints.ackermann import Ackermann
from robsim.robot.joints.car import Steering
from robsim.robot.joints.chord import Chord
from robsim.robot.joints.couplings import Coupling
from robsim.robot.joints.joint_kind import JointKind, JointParts, check_joint_kind
from robsim.robot.joints.joint_registry import JOINTS, find_joint_kind, list_single_kinds
from robsim.robot.joints.mimic import Mimic
from robsim.robot.joints.rolling_wheel import Rolling

__all__ = ["Ackermann", "Chord", "Coupling", "Joint", "JointKind", "Mimic", "Rolling", "Steering"]

LIMIT_SLACK = 1e-9  # metres or radians by which rounding may exceed a limit
DH_POSES = ("place", "tail")  # that a row gives
_REQUIRED_PARTS: dict[str, type[Any]] = {
    "curve": Curve,
    "steering": Steering,
}  # fields that a kind needs


@dataclass(frozen=True)
class Joint:
    """A joint: a constant pose `place`, a motion by q, a constant pose `tail`.

    A revolute joint turns about z and a prismatic one slides along it. A floating joint moves
    freely, a planar one in the plane z = 0; so do a unicycle and a car, which cannot move
    sideways, and a rail, which follows its `curve`, x along it. A car has a `steering`. A kind of
    your own is a `JointKind`.

    `limits` is (lowest, highest) in radians or metres, None for none, or for a rail for its ends.
    `follows` says that the coordinate depends on others (`Mimic`, `Chord`, `Ackermann`, `Rolling`),
    `name` how it is called where the link's name will not do. `speed` (rad/s or m/s) and `effort`
    (N m or N) are what the drive can do: files keep them, and nothing here is held to them.

    `dh` is a row of a Denavit-Hartenberg table, which gives `place` and `tail` of a fixed, revolute
    or prismatic joint. To give another row, or poses instead, use `with_constants`.

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
    curve: Curve | None = field(default=None, kw_only=True)
    steering: Steering | None = field(default=None, kw_only=True)
    follows: Coupling | None = field(default=None, kw_only=True)
    dh: DHRow | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        self._check_kind()
        for part in ("place", "tail"):
            object.__setattr__(self, part, check_single_pose(getattr(self, part), f"joint {part}"))
        if self.dh is not None:
            self._take_row(self.dh)
        if self.name is not None:
            check_name(self.name, "joint")
        for part in ("speed", "effort"):
            if getattr(self, part) is not None:
                object.__setattr__(self, part, as_positive(getattr(self, part), f"joint {part}"))
                if not self.model.single:
                    raise InputError(
                        f"a {self.model.name} joint has no {part} of its own; {list_single_kinds()} have"
                    )
        for part, expected in _REQUIRED_PARTS.items():
            self._check(part, expected)
        self._check_follows()
        self._check_limits()

    @cached_property
    def model(self) -> JointKind:
        """The kind of the joint as a `JointKind`."""
        return find_joint_kind(self.kind)

    @property
    def moves(self) -> bool:
        """Whether the joint has a coordinate, its own or one that follows others."""
        return bool(self.model.coordinates)

    @property
    def tied(self) -> bool:
        """Whether its coordinate depends on others; that of a rolling wheel is its own."""
        return self.follows is not None and self.follows.tied

    @cached_property
    def parts(self) -> JointKind | JointParts:
        """The own coordinates and velocities; none if the joint follows others."""
        if self.follows is None:
            return self.model
        return JointParts() if self.tied else JointParts(self.model.coordinates, self.model.units)

    @property
    def needed(self) -> Any:
        """The curve or the steering of the joint, if its kind needs one."""
        return None if self.model.needs is None else getattr(self, self.model.needs)

    def within(self, prefix: str) -> Joint:
        """Return the joint in a scene, where a prefix precedes the names of coordinates."""
        if self.follows is None or not self.tied:
            return self
        return self.following(f"{prefix}.{self.follows.of}")

    def following(self, name: str) -> Joint:
        """Return a copy that follows the coordinate with this name."""
        assert self.follows is not None
        return replace(self, follows=replace(self.follows, of=name))  # type: ignore[type-var]

    def with_constants(
        self, place: Any = IDENTITY, tail: Any = IDENTITY, dh: DHRow | None = None
    ) -> Joint:
        """Return a copy with other constants: two poses, or a row of a Denavit-Hartenberg table.

        >>> joint = Joint("revolute", dh=DHRow(theta=0, d=0, a=0.5, alpha=0))
        >>> joint.with_constants(dh=replace(joint.dh, a=0.6)).tail.position
        array([0.6, 0. , 0. ])
        """
        return replace(self, place=place, tail=tail, dh=dh)

    def revised(self, **changes: Any) -> Joint:
        """Return a copy in which only numbers differ; a row gives its own constants."""
        if "dh" in changes:
            return self.held(**changes)
        if self.dh is not None and changes.keys() & {"place", "tail"}:
            raise InputError("dh and place or tail: give one of the two only")
        return replace(self, **changes)

    def held(self, **changes: Any) -> Joint:
        """Return a copy with numbers that may differ from run to run."""
        row = changes.get("dh")
        constants = (
            {} if row is None else dict(zip(DH_POSES, row.constants(self.model.turns), strict=True))
        )
        return replace_unchecked(self, **changes, **constants)

    def _take_row(self, row: Any) -> None:
        """Keep the constants of a row; InputError if poses are given that are not these."""
        if not isinstance(row, DHRow):
            raise InputError(f"joint dh: expected a DHRow, got {format_value(row)}")
        if not self.model.rowed:
            raise InputError(f"a {self.model.name} joint has place and tail, not dh")
        given = self.place, self.tail
        place, tail = row.constants(self.model.turns)
        if given not in ((IDENTITY, IDENTITY), (place, tail)):
            raise InputError("dh and place or tail: give one of the two only")
        object.__setattr__(self, "place", place)
        object.__setattr__(self, "tail", tail)

    def _check_kind(self) -> None:
        if not self.model.own and JOINTS.get(self.model.name) is type(self.model):
            object.__setattr__(self, "kind", self.model.name)  # built-in kinds are stored by name
        else:
            check_joint_kind(self.model)

    def _check(self, part: str, expected: type) -> None:
        """Raise InputError unless the part is present exactly if the kind of the joint needs it."""
        value, needs = getattr(self, part), self.model.needs == part
        if value is None and needs:
            raise InputError(f"a {self.model.name} joint needs a {part}")
        if value is not None and not needs:
            kind = next(name for name, kind in JOINTS.kinds.items() if kind.needs == part)
            raise InputError(f"a {self.model.name} joint has no {part}: that is for a {kind}")
        if value is not None and not isinstance(value, expected):
            raise InputError(f"{part}: expected a {expected.__name__}, got {format_value(value)}")

    def _check_follows(self) -> None:
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
            raise InputError(f"{what}, and a {self.model.name} joint moves otherwise")

    def _check_limits(self) -> None:
        if self.limits is None:
            if self.follows is None:
                object.__setattr__(self, "limits", self.model.span(self.needed))
            return
        limits = as_floats(self.limits, "joint limits", (2,))
        if not self.model.single:
            raise InputError(f"a {self.model.name} joint has no limits, got {self.limits}")
        if limits.ndim != 1 or not limits[0] < limits[1]:
            raise InputError(f"joint limits must be (lowest, highest), got {self.limits}")
        if self.follows is not None and not self.follows.limited:
            raise InputError(
                f"limits of a joint that follows by {type(self.follows).__name__} are not looked "
                f"at: limit '{self.follows.of}'"
            )
        if self.kind == "revolute":
            warn_of_degrees(self.limits, "joint limits")
        object.__setattr__(self, "limits", tuple(limits.tolist()))


FIXED = Joint()


def list_coordinate_units(joints: Sequence[Joint]) -> tuple[str, ...]:
    """Return the unit "rad", "m" or "1" of each coordinate of the joints."""
    return tuple(unit for joint in joints for unit in joint.parts.units)
