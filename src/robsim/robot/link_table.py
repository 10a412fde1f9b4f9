"""The text form of a link with its joint."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from robsim.base.errors import InputError
from robsim.declare import Choice, ListOf, Name, Number, Role, Stacked, Table
from robsim.declare.joints import Axes, OfJoint, PerJoint, unit_of
from robsim.declare.problems import under
from robsim.declare.spec import Context, NoText, Raw
from robsim.geometry.curves.curve import CURVES
from robsim.geometry.inertia import Inertia
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.pose_table import PoseTable
from robsim.geometry.primitives.primitive import SHAPES, Primitive
from robsim.robot.dh_row import DHRow
from robsim.robot.joint import Joint, Steering
from robsim.robot.joints.coupling import COUPLINGS
from robsim.robot.joints.registry import JOINTS, kind_of, without_parameters
from robsim.robot.link import Link

SHAPE = Choice(SHAPES, short=False)
SHAPE_LIST = ListOf(SHAPE, most=256, by_hand=False)
LABEL = Name()


@dataclass(frozen=True)
class JointChoice(Choice):
    """The declaration of a kind of joint: its name, or a table with its parameters."""

    __hash__ = Choice.__hash__

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        return ()

    def write(self, value: Any, c: Context) -> Raw:
        kind = kind_of(value)
        return super().write(kind, c)


def _ends(c: Context) -> Axes:
    """Return the ends of the range of the joint whose table is around."""
    return Axes([unit_of(c)] * 2, ["lowest", "highest"])


@dataclass(frozen=True)
class Span(PerJoint):
    """The declaration of joint limits: the lowest and highest coordinate, in the joint's unit."""

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        return ()

    def _list_of(self, words: str) -> str:
        return "[lowest, highest] in the unit of the joint"


@dataclass(frozen=True)
class LinkTable:
    """The text form of a link; the constants of its joint are a row `dh`, or `place` and `tail`."""

    stands: ClassVar[Mapping[str, str]] = {
        "joint": "joint.kind",
        "joint_name": "joint.name",
        **{key: f"joint.{key}" for key in ("speed", "effort", "curve", "steering", "follows")},
        **{key: f"joint.{key}" for key in ("dh", "place", "tail", "limits")},
    }

    name: Annotated[str, LABEL, "Name of the link."]
    parent: Annotated[str | None, LABEL, "Link that carries the joint; None: the one before."] = (
        None
    )
    joint: Annotated[Any, JointChoice(JOINTS), "Kind of the joint that moves the link."] = "fixed"
    joint_name: Annotated[
        str | None, LABEL, "Name of the joint and its coordinates; None: that of the link."
    ] = None
    speed: Annotated[
        float | None, OfJoint("/s", above=0), Role.FILE, "Largest speed of the drive."
    ] = None
    effort: Annotated[
        float | None,
        Number(above=0),
        Role.FILE,
        "Largest torque or force of the drive, in N m or N.",
    ] = None
    curve: Annotated[Any, Choice(CURVES, short=False), "Curve that a joint on a rail follows."] = (
        None
    )
    steering: Annotated[Steering | None, Table(Steering), "Steering of a car."] = None
    follows: Annotated[
        Any, Choice(COUPLINGS, short=False), "Coupling by which the coordinate follows others."
    ] = None
    dh: Annotated[DHRow | None, Table(DHRow), "Row of Denavit-Hartenberg constants."] = None
    place: Annotated[Pose | None, PoseTable(), Stacked(), "Pose of the joint in the parent."] = None
    tail: Annotated[
        Pose | None, PoseTable(), Stacked(), "Pose of the link in the moved frame of the joint."
    ] = None
    limits: Annotated[Any, Span(_ends), "Lowest and highest coordinate."] = None
    shapes: Annotated[
        tuple[Primitive, ...], SHAPE_LIST, Role.FIGURE, "Solids that figures show of the link."
    ] = ()
    inertia: Annotated[
        Inertia | None, Table(Inertia), Role.FILE, "Mass, centre of mass and moments of inertia."
    ] = None

    @classmethod
    def text_facts(cls, raw: Mapping[str, Raw], c: Context) -> Context:
        """Note the kind of joint, which determines the units of other values of the table."""
        joint = raw.get("joint", "fixed")
        name = joint.get("kind") if isinstance(joint, Mapping) else joint
        kind = JOINTS.get(name) if isinstance(name, str) else None
        return c.knowing(joint=kind and without_parameters(kind))

    @classmethod
    def written_facts(cls, value: Link, c: Context) -> Context:
        """Note the kind of joint of a link that is written."""
        return c.knowing(joint=value.joint.model)

    def made(self, c: Context) -> Link:
        """Return the link that the table describes."""
        limits = self.limits
        with under("limits") if limits is not None else under():
            joint = Joint(
                self.joint,
                *self._poses(),
                limits,
                dh=self.dh,
                name=self.joint_name,
                speed=self.speed,
                effort=self.effort,
                curve=self.curve,
                steering=self.steering,
                follows=self.follows,
            )
        return Link(self.name, self.parent, joint, self.shapes, self.inertia)

    @classmethod
    def of(cls, value: Link, c: Context) -> LinkTable:
        """Return the table that describes a link."""
        if type(value) is not Link or type(value.joint) is not Joint:
            raise NoText(f"{type(value).__name__} is Python code")
        joint = value.joint
        return cls(
            value.name,
            value.parent,
            joint.kind,
            joint.name,
            joint.speed,
            joint.effort,
            joint.curve,
            joint.steering,
            joint.follows,
            joint.dh,
            None if joint.dh or joint.place == IDENTITY else joint.place,
            None if joint.dh or joint.tail == IDENTITY else joint.tail,
            joint.limits,
            value.shapes,
            value.inertia,
        )

    def _poses(self) -> tuple[Pose, Pose]:
        """Return the poses that are given for the joint, where a row is not."""
        if self.dh is not None and (self.place is not None or self.tail is not None):
            raise InputError("dh and place or tail: give one of the two only")
        return self.place or IDENTITY, self.tail or IDENTITY
