"""How a text says a robot, with the tools that it carries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any

from robsim.base.errors import InputError
from robsim.declare import Flag, ListOf, Name, Table, Text, Word
from robsim.declare.joints import Axes, PerJoint
from robsim.declare.problems import Misplaced, under
from robsim.declare.scalars import Reference
from robsim.declare.spec import Context, Raw, Spec
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.pose_table import PoseTable
from robsim.robot.joint import units_of
from robsim.robot.link import Link, coordinate_names
from robsim.robot.link_table import LinkTable
from robsim.robot.robot import Robot

LINK = Table(Link, LinkTable)
MOST_LINKS = 256
BASE = (
    "the first link is the base: it has no parent, joint or dh; a robot that moves as a "
    "whole gets a base link first, and then its moving link"
)


@dataclass(frozen=True)
class Links(ListOf):
    """The links of a robot: the base, and each next one on the one before it, if not said."""

    item: Spec = LINK
    least: int = 1
    most: int = MOST_LINKS

    def read(self, raw: Raw, c: Context) -> tuple[Link, ...]:
        first = raw[0] if isinstance(raw, list) and raw and isinstance(raw[0], Mapping) else {}
        if first.get("parent") or first.get("joint", "fixed") != "fixed" or "dh" in first:
            raise Misplaced(str(first.get("name", "[0]")), BASE)
        return tuple(super().read(raw, c))


TAKEN = {
    "model": {"type": "string", "description": "The name of a robot of the library."},
    "urdf": {"type": "string", "description": "The path of a URDF file from here."},
}


@dataclass(frozen=True)
class LinkedSpec(Table):
    """Links of a text: all of them, or those of a library robot or a URDF file with changes."""

    def schema(self, define: Any) -> dict[str, Any]:
        form = self.says or self.kind
        taken = {"oneOf": [{"required": [key]} for key in TAKEN]}
        changed = {"allOf": [define.changes(form, **TAKEN), taken]}
        return {"anyOf": [define(form, **TAKEN), changed]}


def _own_joints(c: Context) -> Axes | None:
    """Return the coordinates of the robot whose table is being read or written."""
    links = c.facts["own"].get("links")
    if links is None:
        return None
    return Axes(units_of([link.joint for link in links]), coordinate_names(links))


@dataclass(frozen=True)
class LinkedTable:
    """Links on joints: what robots and tools have in common."""

    name: Annotated[str, Name(), "Its name."]
    links: Annotated[tuple[Link, ...], Links(), "Its links, the base first."]
    pose: Annotated[Pose | None, PoseTable(flat=True), "Where it stands."] = None
    about: Annotated[str | None, Text(), "What it is, in a line."] = None
    sources: Annotated[tuple[str, ...], ListOf(Text(), most=64), "Where its numbers are from."] = ()
    convention: Annotated[
        str | None, Word(("standard", "modified"), "convention"), "Of the rows `dh`."
    ] = None
    home: Annotated[Any, PerJoint(_own_joints), "Where it is at the start."] = None
    tip: Annotated[str | None, Name(), "The link that is meant where none is named."] = None

    @classmethod
    def text_facts(cls, raw: Mapping[str, Raw], c: Context) -> Context:
        """Note the convention, by which the rows of the links are read."""
        return c.knowing(convention=raw.get("convention", "standard"))

    def robot(self) -> Robot:
        """Return a robot in the world, of these links."""
        base, *others = self.links
        before = [base.name, *(link.name for link in others)]
        links = (
            base,
            *(
                link if link.parent else replace(link, parent=before[i])
                for i, link in enumerate(others)
            ),
        )
        try:
            return Robot(self.name, links, self.home, tip=self.tip or "")
        except InputError as error:  # of home, or of links that do not go together
            with under("home" if str(error).startswith(f"{self.name}.home") else "links"):
                raise


@dataclass(frozen=True)
class ToolTable(LinkedTable):
    """What `Robot.with_tool` puts on a link."""

    on: Annotated[str | None, Name(), "Which link; None: the last."] = None
    bare: Annotated[bool, Flag(), "Whether that link loses its shapes."] = False


TOOLS = ListOf(LinkedSpec(ToolTable), most=64)


@dataclass(frozen=True)
class RobotTable(LinkedTable):
    """A robot where it stands; `model` takes one of the library, `urdf` that of a file."""

    on: Annotated[str, Reference, "The frame on which it stands."] = "world"
    tools: Annotated[tuple[Any, ...], TOOLS, "What it carries, one after the other."] = ()

    def made(self, c: Context) -> Robot:
        """Return the robot with its tools."""
        made = self.robot()
        for tool in self.tools:
            with under("tools", tool.name):
                made = made.with_tool(tool.robot(), tool.pose or IDENTITY, tool.on, tool.bare)
        return replace(made, base=self.pose or IDENTITY, on=self.on)

    @classmethod
    def of(cls, value: Robot, c: Context) -> RobotTable:
        """Return what says a robot, link by link."""
        tip = None if value.tip == value.links[-1].name else value.tip
        return cls(value.name, value.links, value.base, home=value.home, tip=tip, on=value.on)


ROBOT = LinkedSpec(Robot, RobotTable)
