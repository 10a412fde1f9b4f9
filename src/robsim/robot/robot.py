"""Robots as trees of links on joints, from a DH table, a URDF file, or link by link."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_bool, make_read_only
from robsim.base.errors import FileWarning, InputError, format_value, suggest_names
from robsim.base.name_check import check_name
from robsim.base.unit_warnings import warn_of_degrees
from robsim.base.value import copy_cached, replace_unchecked
from robsim.geometry.pose import IDENTITY, Pose, check_single_pose
from robsim.geometry.primitives import Primitive
from robsim.robot import robot_overview
from robsim.robot.dh import build_dh_links
from robsim.robot.joint import Ackermann, Chord, Rolling
from robsim.robot.kinematics import Kinematics
from robsim.robot.limits import check_common_limits
from robsim.robot.link import Link
from robsim.robot.robot_origin import RobotOrigin
from robsim.robot.tool import mount_tool

# what is the same in robots whose numbers differ
SHARED_PROPERTIES = (
    *("coordinate_names", "coordinate_units", "velocity_names", "velocity_units"),
    *("nq", "nv", "_angles", "_floats"),
)


@dataclass(frozen=True, eq=False)
class Mounting:
    """A tool on a link of the robot `before`, at `pose`, and the links and tip `of` both."""

    before: Robot
    tool: Robot
    pose: Pose
    on: str
    bare: bool
    of: tuple[tuple[Link, ...], str]


@dataclass(frozen=True, eq=False)
class Robot(Kinematics):
    """A tree of links, of which the first is the base; it stands at `base` on the frame `on`.

    `tip` is the link that methods use by default: the last one, unless it is given. `home` is
    (nq,) or a mapping from the names of coordinates to values; missing values are zero, or the
    nearest that the limits allow.

    Coordinates q (..., nq) come joint by joint: one each for revolute (radians) and prismatic
    (metres) joints, seven for floating ones (position, unit quaternion x y z w), three for planar
    joints and unicycles (x, y, theta), a fourth for cars (the steering angle), one for rails (arc
    length, metres). Velocities (..., nv) likewise, in the axes that the link has before its tail:
    the body twist (v, omega) of a floating joint, (vx, vy, omega) of a planar one, (v, omega) of
    a unicycle or car, along x and about z, the speed along a rail. A joint that follows others has
    none of its own; a rolling wheel has its angle as a coordinate, and no velocity.

    `origin` is the library robot or the URDF file that it was read from, also where it was changed
    since, and `mounting` the last tool that `with_tool` gave it; both have no part in equality.
    """

    name: str
    links: tuple[Link, ...]
    home: Any = None
    base: Pose = field(default=IDENTITY, kw_only=True)
    on: str = field(default="world", kw_only=True)
    tip: str = field(default="", kw_only=True)
    origin: RobotOrigin | None = field(default=None, kw_only=True, compare=False)
    mounting: Mounting | None = field(default=None, kw_only=True, compare=False, repr=False)

    def __post_init__(self) -> None:
        check_name(self.name, "robot")
        object.__setattr__(self, "base", check_single_pose(self.base, f"base of '{self.name}'"))
        if not isinstance(self.on, str):
            raise InputError(f"on: expected the name of a frame, got {format_value(self.on)}")
        given = (self.links,) if isinstance(self.links, Link) else self.links
        if not isinstance(given, Sequence) or not all(isinstance(link, Link) for link in given):
            raise InputError(f"robot '{self.name}' needs a list of Link, got {format_value(given)}")
        if not given:
            raise InputError(f"robot '{self.name}' needs at least one Link, its base")
        object.__setattr__(self, "links", tuple(given))
        base = self.links[0]
        if base.joint.moves or base.parent is not None:
            raise InputError(
                f"link '{base.name}' is the base of '{self.name}': it hangs from nothing and does "
                "not move; let the next link move"
            )
        for link in self.links[1:]:
            if link.parent is None:
                raise InputError(f"link '{link.name}' has no parent; only the base has none")
        _ = self.tree  # an unknown parent is an error now, not later
        last = isinstance(self.tip, str) and not self.tip
        object.__setattr__(self, "tip", self._link(self.links[-1].name if last else self.tip))
        check_common_limits(self._ranges, self.coordinate_names, self.name)
        home = self._full_home(f"{self.name}.home")
        if home.ndim != 1:
            raise InputError(f"{self.name}.home: expected shape ({self.nq},), got {home.shape}")
        object.__setattr__(self, "home", make_read_only(home))

    def revised(self, **changes: Any) -> Robot:
        """Return a copy in which only numbers differ; what they do not touch is as it was."""
        made = replace_unchecked(self, **changes)
        copy_cached(self, made, SHARED_PROPERTIES)
        if made.links is self.links:
            copy_cached(self, made, ("tree",))
        elif _list_wheel_mounts(made.links) != _list_wheel_mounts(self.links):
            _ = made.tree  # whether what follows others still fits together
        same = _list_limit_sources(made.links) == _list_limit_sources(self.links)
        if same:
            copy_cached(self, made, ("_ranges",))
        else:
            _check_chord_curves(made.links)
            check_common_limits(made._ranges, made.coordinate_names, made.name)
        if not same or "home" in changes:
            object.__setattr__(made, "home", make_read_only(made._full_home(f"{made.name}.home")))
        return made

    def __str__(self) -> str:
        coordinates = ", ".join(self.coordinate_names) or "none"
        return f"{self.name}: {len(self.links)} links to '{self.tip}', coordinates: {coordinates}"

    def __repr__(self) -> str:
        """Return a line with the name, the number of links and the coordinates."""
        return robot_overview.describe_robot(self)

    def _repr_html_(self) -> str:
        """Return a table of the coordinates for notebooks."""
        return robot_overview.render_robot_table(self)

    @classmethod
    def from_dh(
        cls,
        rows: ArrayLike,
        convention: Literal["standard", "modified"] = "standard",
        joints: str | None = None,
        home: ArrayLike | None = None,
        limits: ArrayLike | None = None,
        name: str = "robot",
        links: Sequence[str] | None = None,
        shapes: Sequence[Sequence[Primitive]] | None = None,
    ) -> Robot:
        """Return a robot from a Denavit-Hartenberg table (n, 4) of theta, d, a, alpha in SI units.

        Standard (chapter, eq. 3): T = Rz(theta) Tz(d) Tx(a) Rx(alpha). Modified (Craig):
        T = Rx(alpha) Tx(a) Rz(theta) Tz(d). The coordinate is added to theta of an "R" joint and
        to d of a "P" joint. `limits` is (n, 2); links are called link1 ... unless named. `shapes`
        lists the primitives of the base and of each link, in that link's axes.

        >>> arm = Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]], name="planar")
        >>> arm.fk([0, 0])[:3, 3]
        array([2., 0., 0.])
        """
        parts = build_dh_links(rows, convention, joints, limits, links, shapes)
        return cls(name, parts, home)

    @classmethod
    def from_urdf(
        cls, path: str | os.PathLike[str], tip: str | None = None, home: Any = None
    ) -> Robot:
        """Read a robot from a URDF file; its meshes are opened when they are drawn.

        path   of the file
        tip    the link that methods use by default. None takes, of the links that joints
               move and nothing hangs from, one called tcp, tool0, tool, ee, flange or the like,
               else the one behind the most joints; a FileWarning names all that would do as well
        home   (nq,) or {coordinate: value}, rad and m. None is zero, or what the limits allow
               next to it

        Coordinates are called after the joints, in their order; a link has the name that it has
        there. Shapes are what is to be seen of a link, or what it collides by where nothing is;
        opacities and textures are left out. The kinematics are read strictly: FileError lists all
        errors with their lines. Shapes and inertias that cannot be used are left out, and long
        names shortened; one FileWarning lists where. FrameError: no link is called `tip`.
        InputError: `home` does not fit the coordinates or their limits.

        >>> Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]], name="planar").to_urdf("planar.urdf")
        >>> Robot.from_urdf("planar.urdf", home={"link2": 0.5}).home
        array([0. , 0.5])
        """
        from robsim.robot import urdf  # only where it is used, for a quick start

        robot, found = urdf.read_urdf(path, lambda name, links, end: cls(name, links, tip=end))
        if tip is None and found.others:
            warnings.warn(f"{path}: {found.warning}", FileWarning, stacklevel=2)
        origin = RobotOrigin(urdf=os.path.abspath(path))
        if tip is None and home is None:
            return replace(robot, origin=origin)
        return replace(robot, tip=found.name if tip is None else tip, home=home, origin=origin)

    def to_urdf(self, path: str | os.PathLike[str]) -> None:
        """Write a URDF file, from which the same links, poses, limits and inertias can be read.

        Where the base stands, home, and the `n` of circles are not written. A link beside the axis
        of its joint (as with DH rows) takes a second one, "elbow.axis", which RobSim removes again
        when it reads the file. A camera body becomes two boxes. A link that moves and weighs
        nothing gets 1 g and 1e-6 kg m^2, so that simulators take it. InputError: rails, vehicles
        and what follows by other than Mimic, which the format cannot express, by name.
        """
        from robsim.robot import urdf  # only where it is used, for a quick start

        urdf.write_urdf(self.name, self.links, self.tip, path)

    def to_mjcf(self, path: str | os.PathLike[str]) -> None:
        """Write a MuJoCo model with bodies, joints, geoms, inertias, and equalities for mimics.

        Joints are called as our coordinates; a planar one becomes two slides and a hinge, "deck.x",
        "deck.y" and "deck.theta". What floats must stand on what does not move; the coordinates
        of its free joint are the pose of the body in the world. The base stands at the origin.
        Meshes are left out, with a FileWarning; the rest is as in `to_urdf`.
        """
        from robsim.robot import urdf  # only where it is used, for a quick start

        urdf.write_mjcf(self.name, self.links, self.tree, path)

    def at(self, pose: Any, on: str | None = None) -> Robot:
        """Return a copy whose base is moved by `pose`, or stands on another frame of the scene.

        >>> Robot.from_dh([[0, 0, 1, 0]]).at(Pose.at(0, 0, 1)).base.position
        array([0., 0., 1.])
        """
        moved = check_single_pose(pose, f"base of '{self.name}'")
        if on is None:
            return replace(self, base=moved @ self.base)
        return replace(self, base=moved, on=on)

    def named(self, name: str) -> Robot:
        """Return a copy with another name, for a second one in a scene."""
        return replace(self, name=name)

    def with_tool(
        self, tool: Robot, pose: Any = IDENTITY, on: str | None = None, bare: bool = False
    ) -> Robot:
        """Return a copy with a tool at `pose` on its link `on` (the tip by default).

        Links and coordinates of the tool come after its own, at home as the tool is, and its tip
        is that of the tool; a name that both have gets that of the tool in front, as in
        "gripper_base". The base link of the tool no longer is one, but a link that does not move.
        `bare` takes the shapes of the link `on` away, for a tool that stands for what was drawn
        there.

        >>> import robsim as rs
        >>> at = Pose.at(z=-0.1083)  # the tool frame of this arm lies between the finger tips
        >>> rhino = rs.robots.rhino_xr4().with_tool(rs.robots.rhino_gripper(), at, bare=True)
        >>> rhino.coordinate_names[-1], rhino.tip
        ('opening', 'tip')
        """
        if not isinstance(tool, Robot):
            raise InputError(f"tool: expected a Robot, got {format_value(tool)}")
        if tool.on != "world":
            raise InputError(
                f"the tool '{tool.name}' stands on '{tool.on}', not on '{self.name}'; give the "
                "pose and the link to with_tool instead"
            )
        as_bool(bare, "bare")
        at = check_single_pose(pose, f"pose of the tool '{tool.name}'") @ tool.base
        carrier, without = self._link(on), bool(bare)
        links = mount_tool(self.links, tool.links, tool.name, carrier, at, without)
        number = [link.name for link in tool.links].index(tool.tip)
        tip = links[len(self.links) + number].name
        home = np.concatenate([self.home, tool.home])
        mounting = Mounting(self, tool, at, carrier, without, (links, tip))
        return replace(self, links=links, tip=tip, home=home, mounting=mounting)

    @property
    def mountings(self) -> tuple[Mounting, ...]:
        """The tools that it was given, the first one first; none where its links are others now."""
        last = self.mounting
        if last is None or last.of != (self.links, self.tip):
            return ()
        return (*last.before.mountings, last)

    def _full_home(self, what: str) -> Array:
        """Return home as it was given, with missing coordinates as close to zero as allowed."""
        if self.home is not None and not isinstance(self.home, Mapping):
            return self.coordinates(self.home, what)
        given, names = dict(self.home or {}), self.coordinate_names
        for name in given:
            if name not in names:
                hint = suggest_names(name, names, "coordinates")
                raise InputError(f"{what}: no coordinate {format_value(name)}; {hint}")
        nearest = np.clip(self.rest, *self.limits.T).tolist()
        full = [given.get(name, zero) for name, zero in zip(names, nearest, strict=True)]
        home = self._valid(full, what)
        warn_of_degrees(home[[i for i in self._angles if names[i] in given]], what)
        return home


def _list_limit_sources(links: Sequence[Link]) -> list[Any]:
    """Return what the limits of coordinates follow from."""
    joints = [link.joint for link in links]
    return [(joint.limits, joint.follows, joint.needed) for joint in joints]


def _list_wheel_mounts(links: Sequence[Link]) -> list[Any]:
    """Return from what follows whether wheels fit on their vehicles."""
    joints = [link.joint for link in links]
    if not any(isinstance(joint.follows, Ackermann | Rolling) for joint in joints):
        return []
    return [(id(j.place), id(j.tail), j.follows, j.steering) for j in joints]


def _check_chord_curves(links: Sequence[Link]) -> None:
    """Raise InputError for a chord that does not fit the curve of its rail."""
    curves = {link.label: link.joint.curve for link in links}
    for link in links:
        follows = link.joint.follows
        curve = curves.get(follows.of) if isinstance(follows, Chord) else None
        if isinstance(follows, Chord) and curve is not None:
            follows.check(link.name, curve)
