"""Text form of a robot with its tools."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated, Any, ClassVar, cast

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Flag, ListOf, Name, PerRun, Role, Text, Word
from robsim.declare.context import MISSING, Context, Raw, UnwritableChange
from robsim.declare.fields import is_identical
from robsim.declare.joint_numbers import Axes, PerJoint
from robsim.declare.lists import get_item_label
from robsim.declare.problems import prefix_path
from robsim.declare.spec import Spec
from robsim.declare.tables import PartTable
from robsim.declare.texts import FrameReference
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.pose_table import FLAT_POSE
from robsim.robot.dh_row import DH_CONVENTIONS
from robsim.robot.dh_table import convert_chain_schema, expand_dh_table
from robsim.robot.joint import list_coordinate_units
from robsim.robot.link import Link, list_coordinate_names
from robsim.robot.link_table import LinkTable
from robsim.robot.robot import Robot
from robsim.robot.robot_origin import ORIGIN_KEYS, RobotOrigin

LINK_SPEC = PartTable(Link, LinkTable)
CONVENTION = Word(DH_CONVENTIONS, "convention")
MOST_LINKS = 256
MOST_LISTED_PARTS = 64  # largest number of robots in a scene, tools of a robot, and similar parts
BASE_MESSAGE = (
    "the first link is the base: it has no parent, joint or dh; a robot that moves as a "
    "whole gets a base link first, and then its moving link"
)


@dataclass(frozen=True)
class LinkList(ListOf):
    """Declaration of the links of a robot; the default parent of a link is the previous link."""

    def read(self, raw: Raw, c: Context) -> tuple[Link, ...]:
        if c.over is not MISSING:
            return super().read(raw, c)
        first = raw[0] if isinstance(raw, list) and raw and isinstance(raw[0], Mapping) else {}
        if first.get("parent") or first.get("joint", "fixed") != "fixed" or "dh" in first:
            with prefix_path(get_item_label(first, 0)):
                raise InputError(BASE_MESSAGE)
        return tuple(super().read(raw, c))

    def write(self, value: Any, c: Context) -> list[Raw]:
        return super().write(_drop_default_parents(value) if c.facts.get("brief") else value, c)


def _drop_default_parents(links: Sequence[Link]) -> list[Link]:
    """Return the links, with None for a parent that is the previous link, the default."""
    before = [None, *(link.name for link in links)]
    return [
        replace(link, parent=None) if link.parent == name else link
        for link, name in zip(links, before, strict=False)
    ]


@dataclass(frozen=True)
class LinkTreeSpec(PartTable):
    """Declaration of a robot or tool: its links, or a library robot or URDF file with changes."""

    def read(self, raw: Raw, c: Context) -> Any:
        raw = expand_dh_table(raw) if c.over is MISSING else raw
        origin = [key for key in ORIGIN_KEYS if isinstance(raw, Mapping) and key in raw]
        if not origin or "library" not in c.facts:
            return super().read(raw, c)
        if len(origin) > 1:
            raise InputError("model and urdf: give one of the two only")
        rest = {key: part for key, part in raw.items() if key not in ORIGIN_KEYS}
        original = c.facts["library"](raw)
        return super().read(rest, c.with_old_value(self._as_text_form(original)))

    def build_table(self, value: Any, c: Context, key: str | None = None) -> dict[str, Raw]:
        if c.over is MISSING and "read_origin" in c.facts:
            with suppress(InputError, UnwritableChange):
                keys, original = c.facts["read_origin"](value)
                original = self._as_text_form(original)
                own = replace(value, origin=original.origin)
                return {**keys, **super().build_table(own, c.with_old_value(original))}
        return super().build_table(value, c, key)

    def schema(self, define: Any) -> dict[str, Any]:
        form = self.says or self.kind
        origins = {"oneOf": [{"required": [key]} for key in ORIGIN_KEYS]}
        changes = {"allOf": [define.changes(form), origins]}
        return {"anyOf": [define(form), changes, convert_chain_schema(define.table(form, {}, []))]}

    def _as_text_form(self, robot: Robot) -> Any:
        """Return a robot in the form that the text changes: a robot, or the table of a tool."""
        return robot if self.kind is Robot else make_tool_table(robot, robot.home)


@dataclass(frozen=True)
class OriginSpec(Spec):
    """Declaration of the keys `model` and `urdf`, which the table of links reads and writes."""

    phrase: ClassVar[str] = "a text"

    def keys(self, name: str) -> tuple[str, ...]:
        return tuple(ORIGIN_KEYS)

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> Any:
        return MISSING

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        """Write nothing: the links are in the table."""

    def properties(self, name: str, define: Any) -> dict[str, Any]:
        return {key: {"type": "string", "description": about} for key, about in ORIGIN_KEYS.items()}

    def rows(self, name: str) -> list[tuple[str, str]]:
        return []  # the documentation describes both keys above the table


def _find_home_axes(c: Context) -> Axes | None:
    """Return the coordinates of the robot in the table that is read or written."""
    links = c.facts["own"].get("links")
    if links is None:
        return None
    return Axes(list_coordinate_units([link.joint for link in links]), list_coordinate_names(links))


@dataclass(frozen=True)
class LinkTreeTable:
    """Common text form of robots and tools: links on joints."""

    name: Annotated[str, Name(), "Name of the robot or tool."]
    links: Annotated[tuple[Link, ...], LinkList(LINK_SPEC, 1, MOST_LINKS), "Links, the base first."]
    stands: ClassVar[Mapping[str, str]] = {"pose": "base", "links": "links", "home": "home"}
    pose: Annotated[
        Pose | None, FLAT_POSE, PerRun(), "Pose of the base in the frame that carries it."
    ] = None
    about: Annotated[str | None, Text(), Role.LABEL, "Description in one line."] = None
    sources: Annotated[
        tuple[str, ...], ListOf(Text(), most=64), Role.LABEL, "Sources of the numbers."
    ] = ()
    convention: Annotated[str | None, CONVENTION, "Convention of the rows `dh`."] = None
    home: Annotated[
        Array | None, PerJoint(_find_home_axes), "Coordinates at home, where runs start by default."
    ] = None
    tip: Annotated[str | None, Name(), "Link that methods use by default."] = None
    origin: Annotated[
        RobotOrigin | None, OriginSpec(), "Library robot or URDF file of the links."
    ] = None

    facts_from: ClassVar[Any] = ("convention",)
    without_controls: ClassVar[Any] = ("convention",)  # another one describes another robot

    @classmethod
    def facts(cls, own: Any, c: Context) -> Context:
        """Return the context with the convention of the Denavit-Hartenberg rows of the links."""
        convention = own.get("convention") or find_dh_convention(own.get("links") or ())
        return c.with_facts(convention=convention or "standard")

    def robot(self) -> Robot:
        """Return a robot in the world with these links."""
        others = [
            link if link.parent else replace(link, parent=previous.name)
            for previous, link in pairwise(self.links)
        ]
        links = (self.links[0], *others)
        try:
            return Robot(self.name, links, self.home, tip=self.tip or "", origin=self.origin)
        except InputError as error:  # wrong home, or links that do not fit together
            with prefix_path("home" if str(error).startswith(f"{self.name}.home") else "links"):
                raise


@dataclass(frozen=True)
class ToolTable(LinkTreeTable):
    """Text form of a tool on a link, see `Robot.with_tool`."""

    on: Annotated[str | None, Name(), "Link that carries the tool. None: the last link."] = None
    bare: Annotated[bool, Flag(), Role.FIGURE, "Whether to leave out the shapes of it."] = False


TOOL_LIST = ListOf(LinkTreeSpec(ToolTable), most=MOST_LISTED_PARTS)


@dataclass(frozen=True)
class RobotTable(LinkTreeTable):
    """Text form of a robot; `model` names a library robot, `urdf` a file."""

    on: Annotated[str, FrameReference, "Frame that carries the robot."] = "world"
    tools: Annotated[tuple[ToolTable, ...], TOOL_LIST, "Tools, in order of mounting."] = ()

    def build_value(self, c: Context) -> Robot:
        """Return the robot with its tools."""
        robot = self.robot()
        for tool in self.tools:
            with prefix_path("tools", tool.name):
                robot = robot.with_tool(tool.robot(), tool.pose or IDENTITY, tool.on, tool.bare)
        return replace(robot, base=self.pose or IDENTITY, on=self.on)

    @classmethod
    def of(cls, value: Robot, c: Context) -> RobotTable:
        """Return the table that describes a robot, link by link."""
        if value.mountings and c.facts.get("short"):
            return _make_table_with_tools(value, c)
        tip = None if value.tip == value.links[-1].name else value.tip
        home = None if c.facts.get("brief") and _is_default_home(value) else value.home
        own: Any = {"home": home, "tip": tip, "convention": find_dh_convention(value.links)}
        return cls(value.name, value.links, value.base, on=value.on, origin=value.origin, **own)


def _make_table_with_tools(value: Robot, c: Context) -> RobotTable:
    """Return the table of a robot with its tools, each with its part of home."""
    mountings, tools = value.mountings, []
    first = mountings[0].before
    arm = replace(first, home=value.home[: first.nq], base=value.base, on=value.on)
    for each in mountings:
        at = each.before.nq
        options = {"pose": each.pose, "on": each.on, "bare": each.bare}
        tools.append(make_tool_table(each.tool, value.home[at : at + each.tool.nq], **options))
    table = RobotTable.of(replace(arm, name=value.name, origin=value.origin), c)
    return replace(table, tools=tuple(tools))


def make_tool_table(tool: Robot, home: Array, **options: Any) -> ToolTable:
    """Return the table of a tool with its home and position."""
    own: Any = {"convention": find_dh_convention(tool.links), "origin": tool.origin, **options}
    return ToolTable(tool.name, tool.links, home=home, tip=tool.tip, **own)


def _is_default_home(robot: Robot) -> bool:
    """Return whether home equals the default home."""
    return is_identical(robot.home, replace(robot, home=cast(Array, None)).home)


def find_dh_convention(links: Sequence[Link]) -> str | None:
    """Return the convention of the first Denavit-Hartenberg row of the links, or None."""
    return next((link.joint.dh.convention for link in links if link.joint.dh), None)


ROBOT = LinkTreeSpec(Robot, RobotTable)
