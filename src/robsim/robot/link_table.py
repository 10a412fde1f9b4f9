"""Text form of a link with its joint."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from robsim.base.errors import InputError
from robsim.declare import KindOf, ListOf, Name, Number, PerRun, Role, Table
from robsim.declare.context import Context, NoTextError
from robsim.declare.joint_numbers import Axes, OfJoint, PerJoint, get_joint_unit
from robsim.declare.problems import prefix_path
from robsim.geometry.curves.curve import CURVES, Curve
from robsim.geometry.inertia import Inertia
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.pose_table import POSE
from robsim.geometry.primitives.primitive import SHAPES, Primitive
from robsim.robot.dh_row import DHRow
from robsim.robot.joint import RESISTANCES, Joint, Steering
from robsim.robot.joints.couplings import COUPLINGS, Coupling
from robsim.robot.joints.joint_kind import JointKind
from robsim.robot.joints.joint_registry import JOINTS, find_joint_kind
from robsim.robot.link import Link

SHAPE = KindOf(SHAPES, short=False)
SHAPE_LIST = ListOf(SHAPE, most=256, by_hand=False)
LINK_NAME = Name()
NOT_NEGATIVE = Number(least=0)
JOINT_KEYS = ("limits", "speed", "effort", *RESISTANCES, "curve", "steering", "follows", "dh")
POSE_KEYS = ("place", "tail")


def _find_limit_axes(c: Context) -> Axes:
    """Return the axes of the limits of the joint in the surrounding table."""
    return Axes([get_joint_unit(c)] * 2, ["lowest", "highest"])


@dataclass(frozen=True)
class JointLimitPair(PerJoint):
    """Declaration of joint limits: the lowest and highest coordinate, in the unit of the joint."""

    def _describe_list(self, words: str) -> str:
        return "[lowest, highest] in the unit of the joint"


@dataclass(frozen=True)
class Resistance(Number):
    """Declaration of a number of the drive or the resistance of a joint with one coordinate."""

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        kind = place.c.facts.get("joint")
        return super().controls(value, place) if kind is not None and kind.single else ()


@dataclass(frozen=True)
class LinkTable:
    """Text form of a link with its joint.

    The constants of the joint are a row `dh`, or the poses `place` and `tail`.
    """

    stands: ClassVar[Mapping[str, str]] = {
        "joint": "joint.kind",
        "joint_name": "joint.name",
        "inertia": "inertia",
        **{key: f"joint.{key}" for key in (*JOINT_KEYS, *POSE_KEYS)},
    }

    name: Annotated[str, LINK_NAME, "Name of the link."]
    parent: Annotated[str | None, LINK_NAME, "Parent link. None: the previous link."] = None
    joint: Annotated[str | JointKind, KindOf(JOINTS), "Kind of the joint that moves the link."] = (
        "fixed"
    )
    joint_name: Annotated[
        str | None, LINK_NAME, "Name of the joint and its coordinates. None: the name of the link."
    ] = None
    speed: Annotated[
        float | None, OfJoint("/s", above=0), Role.FILE, "Largest speed of the drive."
    ] = None
    effort: Annotated[
        float | None,
        Resistance(above=0),
        Role.DRIVE,
        "Largest torque or force of the drive, in N m or N.",
    ] = None
    armature: Annotated[
        float, Resistance(least=0), Role.DRIVE, PerRun(()), "Rotor inertia, in kg m^2 or kg."
    ] = 0.0
    damping: Annotated[
        float,
        Resistance(least=0),
        Role.DRIVE,
        PerRun(()),
        "Coefficient of viscous friction, in N m s/rad or N s/m.",
    ] = 0.0
    friction: Annotated[
        float, Resistance(least=0), Role.DRIVE, PerRun(()), "Coulomb friction, in N m or N."
    ] = 0.0
    curve: Annotated[Curve | None, KindOf(CURVES, short=False), "Curve of a rail."] = None
    steering: Annotated[Steering | None, Table(Steering), "Steering of a car."] = None
    follows: Annotated[
        Coupling | None,
        KindOf(COUPLINGS, short=False),
        "Coupling of the coordinate to other coordinates.",
    ] = None
    dh: Annotated[DHRow | None, Table(DHRow), "Row of Denavit-Hartenberg constants."] = None
    place: Annotated[Pose | None, POSE, PerRun(), "Pose of the joint in the parent."] = None
    tail: Annotated[
        Pose | None, POSE, PerRun(), "Pose of the link in the moved frame of the joint."
    ] = None
    limits: Annotated[
        tuple[float, float] | None,
        JointLimitPair(_find_limit_axes),
        "Lowest and highest coordinate.",
    ] = None
    shapes: Annotated[
        tuple[Primitive, ...], SHAPE_LIST, Role.FIGURE, "Solids of the link, for figures."
    ] = ()
    inertia: Annotated[
        Inertia | None,
        Table(Inertia),
        Role.DRIVE,
        PerRun(),
        "Mass, centre of mass and moments of inertia.",
    ] = None

    facts_from: ClassVar[Any] = ("joint",)
    without_controls: ClassVar[Any] = ("joint", "limits")

    @classmethod
    def facts(cls, own: Any, c: Context) -> Context:
        """Return the context with the kind of joint, which determines the units of other values."""
        joint = own.get("joint")
        return c.with_facts(joint=joint and find_joint_kind(joint))

    def build_value(self, c: Context) -> Link:
        """Return the link that the table describes."""
        if self.dh is not None and (self.place is not None or self.tail is not None):
            raise InputError("dh and place or tail: give one of the two only")
        poses: dict[str, Any] = {key: getattr(self, key) or IDENTITY for key in POSE_KEYS}
        parts = {key: getattr(self, key) for key in JOINT_KEYS}
        with prefix_path("limits") if self.limits is not None else prefix_path():
            joint = Joint(self.joint, **poses, **parts, name=self.joint_name)
        return Link(self.name, self.parent, joint, self.shapes, self.inertia)

    @classmethod
    def of(cls, value: Link, c: Context) -> LinkTable:
        """Return the table that describes a link."""
        joint = value.joint
        if type(value) is not Link or type(joint) is not Joint:
            raise NoTextError(f"{type(value).__name__} is Python code")
        parts = {key: getattr(joint, key) for key in JOINT_KEYS}
        for key in POSE_KEYS:
            pose = getattr(joint, key)
            parts[key] = None if joint.dh or pose == IDENTITY else pose
        parts |= {"joint": joint.model, "joint_name": joint.name}
        return cls(value.name, value.parent, shapes=value.shapes, inertia=value.inertia, **parts)
