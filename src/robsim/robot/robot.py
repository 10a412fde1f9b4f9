"""Robots as trees of links on joints, from a DH table, a URDF file, or link by link."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_bool, as_positive, make_read_only
from robsim.base.errors import FileWarning, InputError, format_value, suggest_names
from robsim.base.name_check import check_name
from robsim.base.parameter_names import name_parameters
from robsim.base.unit_warnings import warn_of_degrees
from robsim.base.value import copy_cached, replace_unchecked
from robsim.geometry.inertia import Inertia
from robsim.geometry.pose import IDENTITY, Pose, PoseLike, check_single_pose
from robsim.geometry.primitives import Primitive
from robsim.robot import robot_overview
from robsim.robot.dh import build_dh_links
from robsim.robot.dynamics import Dynamics
from robsim.robot.joint import Ackermann, Chord, Joint, Rolling
from robsim.robot.limits import check_common_limits
from robsim.robot.link import Link
from robsim.robot.robot_coordinates import Home
from robsim.robot.robot_origin import RobotOrigin
from robsim.robot.tool import mount_tool

# properties that robots with the same structure share
SHARED_PROPERTIES = (
    *("coordinate_names", "coordinate_units", "velocity_names", "velocity_units"),
    *("nq", "nv", "_angle_indices", "_is_floating"),
)


@dataclass(frozen=True, eq=False)
class Mounting:
    """Tool on a link of a robot.

    Attributes
    ----------
    before : Robot
        Robot without the tool.
    tool : Robot
        Tool.
    pose : Pose
        Pose of the base of the tool in the link `on`.
    on : str
        Link of `before` that carries the tool.
    bare : bool
        Whether the shapes of this link are left out.
    of : tuple of the links and a str
        Links and tip of the robot with the tool.
    """

    before: Robot
    tool: Robot
    pose: Pose
    on: str
    bare: bool
    of: tuple[tuple[Link, ...], str]


@name_parameters
@dataclass(frozen=True, eq=False)
class Robot(Dynamics):
    """Tree of links on joints, with a base, a tip and a home configuration.

    The first link is the base. It is placed at `base` on the frame `on` of a scene. Forward
    kinematics, Jacobians and inverse kinematics refer to the base link.

    Parameters
    ----------
    name : str
        Name of the robot, and of its frames "name.link" in a scene.
    links : sequence of Link
        Links, the base first.
    home : array_like of shape (nq,) or mapping of str to float, optional
        Coordinates at home, in rad and m. Missing values are zero, or the nearest value within the
        limits.
    base : Pose, default the identity
        Pose of the base link in the frame `on`.
    on : str, default "world"
        Frame of the scene that carries the robot.
    tip : str, optional
        Default link of `fk`, `jacobian`, `ik` and `with_tool`. Default: the last link.
    origin : RobotOrigin, optional
        Library robot or URDF file that the robot was read from. Changed copies have the same
        origin, and it has no effect on equality.
    mounting : Mounting, optional
        The latest tool of `with_tool`. It has no effect on equality.

    Raises
    ------
    InputError
        If the links do not form a tree, the base link moves, or home is outside of the limits.
    FrameError
        If a parent or the tip is not the name of a link.

    Notes
    -----
    The coordinates q (..., nq) are the coordinates of the joints in the order of the links, and the
    velocities v (..., nv) are their velocities in the same order. Velocities refer to the axes of
    the moved frame of the joint, before its tail:

    - revolute: angle (rad); angular velocity (rad/s)
    - prismatic: distance (m); velocity (m/s)
    - floating: position (m) and unit quaternion x, y, z, w; body twist (v, omega)
    - planar: x, y (m) and theta (rad); vx, vy (m/s) and omega (rad/s)
    - unicycle: x, y and theta; v along x (m/s) and omega about z (rad/s)
    - car: x, y, theta and the steering angle (rad); v along x and omega about z
    - rail: arc length (m); speed along the curve (m/s)

    A coupled joint adds no coordinates. A rolling wheel adds its angle as a coordinate, and no
    velocity.

    Examples
    --------
    >>> from robsim.joints import Joint
    >>> base, arm = Link("base"), Link("arm", "base", Joint("revolute"))
    >>> robot = Robot("lever", [base, arm], home={"arm": 0.5})
    >>> robot.coordinate_names, robot.home
    (('arm',), array([0.5]))
    """

    name: str
    links: tuple[Link, ...]
    home: Array = None  # type: ignore[assignment]  # converted by __post_init__
    base: Pose = field(default=IDENTITY, kw_only=True)
    on: str = field(default="world", kw_only=True)
    tip: str = field(default="", kw_only=True)
    origin: RobotOrigin | None = field(default=None, kw_only=True, compare=False)
    mounting: Mounting | None = field(default=None, kw_only=True, compare=False, repr=False)

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            name: str,
            links: Link | Sequence[Link],
            home: Home | None = None,
            *,
            base: PoseLike = IDENTITY,
            on: str = "world",
            tip: str = "",
            origin: RobotOrigin | None = None,
            mounting: Mounting | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        check_name(self.name, "robot")
        object.__setattr__(self, "base", check_single_pose(self.base, f"base of '{self.name}'"))
        if not isinstance(self.on, str):
            raise InputError(f"on: expected the name of a frame, got {format_value(self.on)}")
        links = (self.links,) if isinstance(self.links, Link) else self.links
        if not isinstance(links, Sequence) or not all(isinstance(link, Link) for link in links):
            raise InputError(f"robot '{self.name}' needs a list of Link, got {format_value(links)}")
        if not links:
            raise InputError(f"robot '{self.name}' needs at least one Link, its base")
        object.__setattr__(self, "links", tuple(links))
        base = self.links[0]
        if base.joint.moves or base.parent is not None:
            raise InputError(
                f"link '{base.name}' is the base of '{self.name}': it has no parent and does "
                "not move; let the next link move"
            )
        for link in self.links[1:]:
            if link.parent is None:
                raise InputError(f"link '{link.name}' has no parent; only the base has none")
        _ = self.tree  # raises for an unknown parent
        unset = isinstance(self.tip, str) and not self.tip
        object.__setattr__(self, "tip", self._link(self.links[-1].name if unset else self.tip))
        check_common_limits(self._ranges, self.coordinate_names, self.name)
        home = self._complete_home(f"{self.name}.home")
        if home.ndim != 1:
            raise InputError(f"{self.name}.home: expected shape ({self.nq},), got {home.shape}")
        object.__setattr__(self, "home", make_read_only(home))

    def revised(self, **changes: Any) -> Robot:  # Any: values of the fields named
        """Return a copy with other numbers and the same structure, reusing unchanged results."""
        robot = replace_unchecked(self, **changes)
        copy_cached(self, robot, SHARED_PROPERTIES)
        if robot.links is self.links:
            copy_cached(self, robot, ("tree",))
        elif _list_wheel_mounts(robot.links) != _list_wheel_mounts(self.links):
            _ = robot.tree  # raises if wheels no longer fit their vehicles
        same_limits = _list_limit_sources(robot.links) == _list_limit_sources(self.links)
        if same_limits:
            copy_cached(self, robot, ("_ranges",))
        else:
            _check_chord_curves(robot.links)
            check_common_limits(robot._ranges, robot.coordinate_names, robot.name)
        if not same_limits or "home" in changes:
            object.__setattr__(
                robot, "home", make_read_only(robot._complete_home(f"{robot.name}.home"))
            )
        return robot

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
        """Return a robot from a Denavit-Hartenberg table.

        A row is the transform from one link to the next, in the standard convention (chapter, eq.
        3)

            T = Rz(theta) Tz(d) Tx(a) Rx(alpha),

        and in the modified convention (Craig)

            T = Rx(alpha) Tx(a) Rz(theta) Tz(d).

        The coordinate is added to theta of a revolute joint and to d of a prismatic joint.

        Parameters
        ----------
        rows : array_like of shape (n, 4)
            Rows (theta, d, a, alpha) in rad and m.
        convention : {"standard", "modified"}, default "standard"
            Order of the four elementary transforms.
        joints : str, optional
            One letter for each joint, "R" for revolute and "P" for prismatic. Default: all
            revolute.
        home : array_like of shape (n,), optional
            Coordinates at home. Default: zero, or the nearest values within the limits.
        limits : array_like of shape (n, 2), optional
            Lowest and highest value of each coordinate; (-inf, inf) for a joint without limits.
        name : str, default "robot"
            Name of the robot.
        links : sequence of str, optional
            Names of the n links after the base. Default: "link1", "link2" and so on.
        shapes : sequence of sequences of Primitive, optional
            Solids of the base and of each link, n + 1 lists, in the axes of the link.

        Returns
        -------
        Robot
            Robot with a base link "base" and n moving links.

        Raises
        ------
        InputError
            If the arguments do not fit together.

        Examples
        --------
        >>> arm = Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]], name="planar")
        >>> arm.fk([0, 0])[:3, 3]
        array([2., 0., 0.])
        """
        parts = build_dh_links(rows, convention, joints, limits, links, shapes)
        return cls(name, parts, home)

    @classmethod
    def from_urdf(
        cls, path: str | os.PathLike[str], tip: str | None = None, home: Home | None = None
    ) -> Robot:
        """Return a robot from a URDF file.

        The coordinates have the names of the joints, in the order of the file, and links keep their
        names. The shapes of a link are its visual shapes, or its collision shapes if it has no
        visual shapes; opacities and textures are ignored. Mesh files are opened only when they are
        drawn. The kinematics are read strictly. Shapes that cannot be used are left
        out, and long names are shortened, with one warning.

        Parameters
        ----------
        path : str or path-like
            URDF file.
        tip : str, optional
            Default link of the methods. Default: among the moving links without children, a link
            with a name such as tcp, tool0, tool, ee or flange, else the link behind the most
            joints.
        home : array_like of shape (nq,) or mapping of str to float, optional
            Coordinates at home, in rad and m. Default: zero, or the nearest values within the
            limits.

        Returns
        -------
        Robot
            The robot, with `origin` set to the path of the file.

        Raises
        ------
        FileError
            If the file is not valid. The message lists all errors with their lines.
        FrameError
            If no link has the name `tip`.
        InputError
            If `home` does not fit the coordinates or their limits.

        Warns
        -----
        FileWarning
            If parts of the file are left out or changed, or if several links are equally likely
            tips.

        Examples
        --------
        >>> Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]], name="planar").to_urdf("planar.urdf")
        >>> Robot.from_urdf("planar.urdf", home={"link2": 0.5}).home
        array([0. , 0.5])
        """
        from robsim.robot import urdf  # imported here to keep the start of RobSim quick

        robot, choice = urdf.read_urdf(path, lambda name, links, end: cls(name, links, tip=end))
        if tip is None and choice.others:
            warnings.warn(f"{path}: {choice.warning}", FileWarning, stacklevel=2)
        origin = RobotOrigin(urdf=os.path.abspath(path))
        if tip is None and home is None:
            return replace(robot, origin=origin)
        tip = choice.name if tip is None else tip
        return replace(robot, tip=tip, home=cast(Array, home), origin=origin)  # converted there

    def to_urdf(self, path: str | os.PathLike[str]) -> None:
        """Write a URDF file that reproduces links, poses, limits and inertias when it is read.

        Damping and friction of joints become a <dynamics> element. URDF has no element for the
        armature, so scenario files and MJCF keep it and URDF does not. Inertias that no rigid body
        has are written as they are; MuJoCo accepts them only in the form of `to_mjcf`. The pose of
        the base, home, and the number `n` of points of circles are not written. If the
        origin of a link is not on the axis of its joint, as with many DH rows, the file contains an
        auxiliary link such as "elbow.axis", which `from_urdf` removes. A camera body becomes two
        boxes. Each moving link without mass gets 1 g and 1e-6 kg m^2, which simulators require.

        Parameters
        ----------
        path : str or path-like
            File to write.

        Raises
        ------
        InputError
            If the robot has rails, vehicles or couplings other than `Mimic`, which URDF cannot
            express. The message names them.

        Examples
        --------
        >>> Robot.from_dh([[0, 0, 1, 0]], name="arm").to_urdf("arm.urdf")
        >>> Robot.from_urdf("arm.urdf").fk([0.0])[:3, 3]
        array([1., 0., 0.])
        """
        from robsim.robot import urdf  # imported here to keep the start of RobSim quick

        urdf.write_urdf(self.name, self.links, self.tip, path)

    def to_mjcf(self, path: str | os.PathLike[str]) -> None:
        """Write a MuJoCo model with bodies, joints, geoms, inertias, and equalities for mimics.

        Joints have the names of the coordinates. A planar joint becomes two slides and a hinge,
        such as "deck.x", "deck.y" and "deck.theta". The coordinates of a free joint are the pose of
        the body in the world. The base is at the origin. Meshes are left out; other shapes and
        missing masses are treated as in `to_urdf`.

        Parameters
        ----------
        path : str or path-like
            File to write.

        Raises
        ------
        InputError
            If MJCF cannot express a joint, such as a floating joint on a moving link.

        Warns
        -----
        FileWarning
            If meshes are left out, or if inertias of links are changed because no rigid body has
            them.

        Examples
        --------
        >>> Robot.from_dh([[0, 0, 1, 0]], name="arm").to_mjcf("arm.xml")
        >>> from pathlib import Path
        >>> 'type="hinge"' in Path("arm.xml").read_text()
        True
        """
        from robsim.robot import urdf  # imported here to keep the start of RobSim quick

        urdf.write_mjcf(self.name, self.links, self.tree, path)

    def at(self, pose: PoseLike, on: str | None = None) -> Robot:
        """Return a copy with its base moved by `pose`, or placed at `pose` on another frame.

        Parameters
        ----------
        pose : Pose or array_like of shape (4, 4)
            Motion of the base to pose @ base, or with `on` the pose of the base in the frame `on`.
        on : str, optional
            Frame of the scene that carries the robot.

        Returns
        -------
        Robot
            The moved robot.

        Examples
        --------
        >>> Robot.from_dh([[0, 0, 1, 0]]).at(Pose.at(0, 0, 1)).base.position
        array([0., 0., 1.])
        """
        placement = check_single_pose(pose, f"base of '{self.name}'")
        if on is None:
            return replace(self, base=placement @ self.base)
        return replace(self, base=placement, on=on)

    def named(self, name: str) -> Robot:
        """Return a copy with another name, so that a scene can contain several equal robots.

        Examples
        --------
        >>> Robot.from_dh([[0, 0, 1, 0]]).named("left").name
        'left'
        """
        return replace(self, name=name)

    def with_tool(
        self, tool: Robot, pose: PoseLike = IDENTITY, on: str | None = None, bare: bool = False
    ) -> Robot:
        """Return a copy with a tool on one of its links.

        The links and coordinates of the tool follow the links and coordinates of the robot, with
        the tool at its own home. The tip becomes the tip of the tool. A name that both use gets a
        prefix in the tool, as in "gripper_base". The base link of the tool becomes a fixed link.

        Parameters
        ----------
        tool : Robot
            Tool on the frame "world".
        pose : Pose or array_like of shape (4, 4), default the identity
            Pose of the tool on the link.
        on : str, optional
            Link that carries the tool. Default: the tip.
        bare : bool, default False
            Whether to remove the shapes of the link `on`, for a tool that replaces them.

        Returns
        -------
        Robot
            The robot with the tool.

        Raises
        ------
        InputError
            If names clash even with the prefix, or the tool is on another frame than "world".

        Examples
        --------
        >>> import robsim as rs
        >>> at = Pose.at(z=-0.1083)  # the tool frame of this arm is between the finger tips
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

    def with_payload(
        self,
        payload: Inertia | float,
        pose: PoseLike = IDENTITY,
        on: str | None = None,
        name: str = "payload",
    ) -> Robot:
        """Return a copy with a payload, which is fixed to one of its links.

        Parameters
        ----------
        payload : Inertia or float
            Inertia of the payload in its own frame, or the mass of a point in kg.
        pose : Pose or array_like of shape (4, 4), default the identity
            Pose of the frame of the payload in the link.
        on : str, optional
            Link that carries the payload. Default: the tip.
        name : str, default "payload"
            Name of the new link, which has the inertia.

        Returns
        -------
        Robot
            The robot with the payload, and with the same tip.

        Raises
        ------
        InputError
            If the payload is not an inertia or a positive mass, or a link has its name.

        Examples
        --------
        >>> from robsim.shapes import Ball
        >>> arm = Robot.from_dh([[0, 0, 1, 0]], shapes=[[], [Ball(0.1, mass=2.0)]])
        >>> arm.with_payload(3.0).mass_matrix([0.0]).round(3)
        array([[5.008]])
        """
        if not isinstance(payload, Inertia):
            payload = Inertia(as_positive(payload, "mass of the payload"), tensor=np.zeros((3, 3)))
        place = check_single_pose(pose, "pose of the payload")
        if name in [link.name for link in self.links]:
            raise InputError(f"robot '{self.name}' has a link {format_value(name)}; give name=...")
        link = Link(name, self._link(on), Joint(place=place), inertia=payload)
        return replace(self, links=(*self.links, link))

    @property
    def mountings(self) -> tuple[Mounting, ...]:
        """Tools in the order of their mounting; empty if links or tip were changed afterwards."""
        last = self.mounting
        if last is None or last.of != (self.links, self.tip):
            return ()
        return (*last.before.mountings, last)

    def _complete_home(self, what: str) -> Array:
        """Return home (nq,), with missing coordinates as close to zero as the limits allow."""
        home = cast(Home | None, self.home)  # before __post_init__ stores the array
        if home is not None and not isinstance(home, Mapping):
            return self.coordinates(home, what)
        values, names = dict(home or {}), self.coordinate_names
        for name in values:
            if name not in names:
                hint = suggest_names(name, names, "coordinates")
                raise InputError(f"{what}: no coordinate {format_value(name)}; {hint}")
        nearest = np.clip(self.rest, *self.limits.T).tolist()
        completed = [values.get(name, zero) for name, zero in zip(names, nearest, strict=True)]
        checked = self._validate(completed, what)
        warn_of_degrees(checked[[i for i in self._angle_indices if names[i] in values]], what)
        return checked


def _list_limit_sources(links: Sequence[Link]) -> list[Any]:
    """Return the parts of joints that determine the limits of the coordinates."""
    joints = [link.joint for link in links]
    return [(joint.limits, joint.follows, joint.required_part) for joint in joints]


def _list_wheel_mounts(links: Sequence[Link]) -> list[Any]:
    """Return the parts of joints that determine whether wheels fit their vehicles."""
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
