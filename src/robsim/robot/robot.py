"""Robots: links on joints, from a DH table or link by link."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, frozen, numbers, runs_first, runs_last
from robsim.base.errors import FrameError, InputError, suggest
from robsim.base.names import checked_name
from robsim.base.values import Value
from robsim.base.warned import warn_of_degrees
from robsim.geometry.pose import (
    IDENTITY,
    Pose,
    as_pose,
    common_lead,
    homogeneous,
    is_pose_like,
    one_pose,
)
from robsim.geometry.primitives import Primitive
from robsim.robot.assembly import Frame
from robsim.robot.dh import dh_constants
from robsim.robot.ik.closed import ClosedIK, solve_closed
from robsim.robot.ik.numeric import Arm, Effort, IKResult, solve
from robsim.robot.joint import FIXED, LIMIT_SLACK, Joint, Mimic, Rolling, units_of
from robsim.robot.link import Link, coordinate_names, velocity_names
from robsim.robot.tool import mounted
from robsim.robot.tree import Tree


@dataclass(frozen=True, eq=False)
class Robot(Value):
    """A tree of links. The first link is the base; it stands at `base` on the frame `on`.

    Coordinates q (..., nq) come joint by joint: one each for revolute (radians) and prismatic
    (metres) joints, seven for floating ones (position, unit quaternion x y z w), three for planar
    joints and unicycles (x, y, theta), a fourth for cars (the steering angle), one for rails (arc
    length, metres). Velocities (..., nv) likewise, in the axes that the link has before its tail:
    the body twist (v, omega) of a floating joint, (vx, vy, omega) of a planar one, (v, omega) of
    a unicycle or car, along x and about z, the speed along a rail. A joint that follows others has
    none of its own; a rolling wheel has its angle as a coordinate, and no velocity.
    """

    name: str
    links: tuple[Link, ...]
    home: Any = None
    base: Pose = field(default=IDENTITY, kw_only=True)
    on: str = field(default="world", kw_only=True)

    def __post_init__(self) -> None:
        checked_name(self.name, "robot")
        object.__setattr__(self, "base", one_pose(self.base, f"base of '{self.name}'"))
        given = (self.links,) if isinstance(self.links, Link) else self.links
        if not isinstance(given, Sequence) or not all(isinstance(link, Link) for link in given):
            raise InputError(f"robot '{self.name}' needs a list of Link, got {given!r:.80}")
        if not given:
            raise InputError(f"robot '{self.name}' needs at least one Link, its base")
        object.__setattr__(self, "links", tuple(given))
        base = self.links[0]
        if base.joint.kind != "fixed" or base.parent is not None:
            raise InputError(
                f"link '{base.name}' is the base of '{self.name}': it hangs from nothing and does "
                "not move; let the next link move"
            )
        for link in self.links[1:]:
            if link.parent is None:
                raise InputError(f"link '{link.name}' has no parent; only the base has none")
        _ = self.tree  # an unknown parent is an error now, not later
        self._check_ranges()
        home = np.clip(self.rest, *self.limits.T)
        if self.home is not None:
            home = self.coordinates(self.home, f"{self.name}.home")
        if home.ndim != 1:
            raise InputError(f"{self.name}.home: expected shape ({self.nq},), got {home.shape}")
        object.__setattr__(self, "home", frozen(home))

    def __str__(self) -> str:
        coordinates = ", ".join(self.coordinate_names) or "none"
        return f"{self.name}: {len(self.links)} links to '{self.tip}', coordinates: {coordinates}"

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
        """From a Denavit-Hartenberg table: rows (n, 4) of theta, d, a, alpha in SI.

        Standard (chapter, eq. 3): T = Rz(theta) Tz(d) Tx(a) Rx(alpha). Modified (Craig):
        T = Rx(alpha) Tx(a) Rz(theta) Tz(d). The coordinate is added to theta of an "R" joint and
        to d of a "P" joint. `limits` is (n, 2); links are called link1 ... unless named. `shapes`
        lists the primitives of the base and of each link, in that link's axes.

        >>> arm = Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]], name="planar")
        >>> arm.fk([0, 0])[:3, 3]
        array([2., 0., 0.])
        """
        table = numbers(rows, "DH rows (theta, d, a, alpha)", ("n", 4))
        n = len(table)
        if table.ndim != 2 or n == 0:
            raise InputError(f"DH rows: expected shape (n, 4), got {table.shape}")
        warn_of_degrees(table[:, [0, 3]], "DH rows (theta, d, a, alpha)")
        kinds = _joint_kinds("R" * n if joints is None else joints, n)
        spans: list[Any] = [None] * n
        if limits is not None:
            spans = [None if np.isinf(span).all() else span for span in _spans(limits, n)]
        if links is not None and (isinstance(links, str) or not isinstance(links, Sequence)):
            raise InputError(f"links: expected a list of {n} names, got {links!r:.80}")
        names = ["base", *(links or [f"link{i + 1}" for i in range(n)])]
        drawn = [tuple(s) for s in (shapes or [()] * (n + 1))]
        if len(names) != n + 1 or len(drawn) != n + 1:
            raise InputError(f"{n} DH rows need {n} link names and {n + 1} lists of shapes")
        parts = [Link("base", shapes=drawn[0])]
        for i in range(n):
            place, tail = dh_constants(table[i], convention, kinds[i])
            joint = Joint(kinds[i], place, tail, tuple(spans[i]) if spans[i] else None)
            parts.append(Link(names[i + 1], names[i], joint, drawn[i + 1]))
        return cls(name, tuple(parts), home)

    @classmethod
    def from_urdf(cls, path: str | os.PathLike[str]) -> Robot:
        """From a URDF file, strictly: nothing that the file names is opened.

        Coordinates are called after the joints, in their order; a link has the name that it has
        there. Shapes are what is to be seen of a link, or what it collides by where nothing is;
        opacities and textures are left out. Home is zero, or what the limits allow next to it.
        FileError: all that is wrong, each with its line; a FileWarning tells what is left out or
        read in another way.
        """
        from robsim.robot import urdf  # only where it is used, for a quick start

        return urdf.read(path, cls)

    def to_urdf(self, path: str | os.PathLike[str]) -> None:
        """Write a URDF file; read back, it has the same links, poses, limits and inertias.

        Where the base stands, home, and the `n` of circles are not written. A link beside the axis
        of its joint (as with DH rows) takes a second one, "elbow.axis", which is gone again when
        RobSim reads the file. A camera body becomes two boxes. A link that moves and weighs
        nothing gets 1 g and 1e-6 kg m^2, so that simulators take it. InputError: rails, vehicles
        and what follows by other than Mimic, which the format cannot express, by name.
        """
        from robsim.robot import urdf  # only where it is used, for a quick start

        urdf.write(self.name, self.links, path)

    def to_mjcf(self, path: str | os.PathLike[str]) -> None:
        """Write a MuJoCo model: bodies, joints, geoms, inertias, and equalities for what mimics.

        Joints are called as our coordinates; a planar one becomes two slides and a hinge, "deck.x",
        "deck.y" and "deck.theta". What floats must stand on what does not move; the coordinates
        of its free joint are the pose of the body in the world. The base stands at the origin.
        Meshes are left out, with a FileWarning; the rest is as in `to_urdf`.
        """
        from robsim.robot import urdf  # only where it is used, for a quick start

        urdf.write_mjcf(self.name, self.links, path)

    @cached_property
    def tree(self) -> Tree:
        """The robot alone, its base link in the world's place."""
        base, *others = self.links
        frames = [Frame(base.name, "world", FIXED)]  # where it stands is the scene's business
        return Tree([*frames, *(Frame(k.name, k.parent or "world", k.joint) for k in others)])

    @property
    def nq(self) -> int:
        """How many coordinates."""
        return self.tree.nq

    @property
    def nv(self) -> int:
        """How many velocities."""
        return self.tree.nv

    @property
    def rest(self) -> Array:
        """All zero, floating joints at the identity."""
        q = np.zeros(self.nq)
        q[[i for i, name in enumerate(self.coordinate_names) if name.endswith(".qw")]] = 1.0
        return q

    @property
    def limits(self) -> Array:
        """(nq, 2): lowest and highest of each coordinate, infinite where there is none.

        A coordinate that others mimic is also held where they are within theirs.
        """
        return self._ranges.copy()

    @cached_property
    def _ranges(self) -> Array:
        """The same, read-only."""
        rows, names = np.empty((self.nq, 2)), self.coordinate_names
        rows[:] = -np.inf, np.inf
        for i, link in enumerate(self._owners):
            if link.joint.steering is not None and names[i].endswith(".steering"):
                rows[i] = np.array([-1, 1]) * link.joint.steering.limit
            elif link.joint.limits is not None:
                rows[i] = link.joint.limits
        number = {name: i for i, name in enumerate(names)}
        follows = {link.label: link.joint.follows for link in self.links}
        for link in self.links:
            if isinstance(link.joint.follows, Mimic) and link.joint.limits is not None:
                source, (low, high) = _mimicked(link, follows, number)
                rows[source] = max(rows[source, 0], low), min(rows[source, 1], high)
        return frozen(rows)

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """One name for each coordinate: the link's, with .x and so on where a joint has several."""
        return coordinate_names(self.links)

    @property
    def coordinate_units(self) -> tuple[str, ...]:
        """ "rad", "m", or "1" of each coordinate."""
        return units_of([link.joint for link in self.links])

    @property
    def velocity_names(self) -> tuple[str, ...]:
        """One name for each velocity."""
        return velocity_names(self.links)

    @property
    def velocity_units(self) -> tuple[str, ...]:
        """ "rad/s" or "m/s" of each velocity."""
        return tuple(unit for link in self.links for unit in link.joint.parts.rates)

    @property
    def tip(self) -> str:
        """The last link."""
        return self.links[-1].name

    def at(self, pose: Any, on: str | None = None) -> Robot:
        """A copy whose base is moved by `pose`, or stands on another frame of the scene.

        >>> Robot.from_dh([[0, 0, 1, 0]]).at(Pose.at(0, 0, 1)).base.position
        array([0., 0., 1.])
        """
        moved = one_pose(pose, f"base of '{self.name}'")
        return replace(self, base=moved @ self.base if on is None else moved, on=on or self.on)

    def named(self, name: str) -> Robot:
        """A copy under another name, for a second one in a scene."""
        return replace(self, name=name)

    def with_tool(
        self, tool: Robot, pose: Any = IDENTITY, on: str | None = None, bare: bool = False
    ) -> Robot:
        """A copy that carries a tool at `pose` on its link `on` (the tip by default).

        Links and coordinates of the tool come after its own, at home as the tool is; a name that
        both have gets that of the tool in front, as in "gripper_base". The base link of the tool
        no longer is one, but a link that does not move. `bare` takes the shapes of the link `on`
        away, for a tool that stands for what was drawn there.

        >>> import robsim as rs
        >>> at = Pose.at(z=-0.1083)  # the tool frame of this arm lies between the finger tips
        >>> rhino = rs.robots.rhino_xr4().with_tool(rs.robots.rhino_gripper(), at, bare=True)
        >>> rhino.coordinate_names[-1], rhino.tip
        ('opening', 'tip')
        """
        if not isinstance(tool, Robot):
            raise InputError(f"tool: expected a Robot, got {tool!r:.80}")
        if tool.on != "world":
            raise InputError(
                f"the tool '{tool.name}' stands on '{tool.on}', not on '{self.name}'; give the "
                "pose and the link to with_tool instead"
            )
        if not isinstance(bare, bool | np.bool_):
            raise InputError(f"bare must be True or False, got {bare!r:.80}")
        at = one_pose(pose, f"pose of the tool '{tool.name}'") @ tool.base
        links = mounted(self.links, tool.links, tool.name, self._link(on), at, bool(bare))
        return replace(self, links=links, home=np.concatenate([self.home, tool.home]))

    def coordinates(self, q: Any, what: str = "q", limits: bool = True) -> Array:
        """Checked coordinates (..., nq), a copy; a Pose is taken where one joint floats.

        InputError: wrong length, not finite, quaternion without length 1, outside the limits.
        UnitWarning: an angle that looks like degrees.
        """
        if self._floats and is_pose_like(q):
            q = as_pose(q).q
        values = numbers(q, what, (self.nq,))
        start = 0
        for link in self.links:
            size = len(link.joint.parts.coordinates)
            if link.joint.kind == "floating":
                quaternion = values[..., start + 3 : start + 7]
                length = np.linalg.norm(quaternion, axis=-1, keepdims=True)
                if (np.abs(length - 1) > 1e-6).any():
                    raise InputError(f"{what}: the quaternion of '{link.name}' must have length 1")
                if (np.abs(length - 1) > 1e-12).any():  # as typed; what is exact stays as it is
                    quaternion /= length
            start += size
        if limits:
            self._check_limits(values, what)
        warn_of_degrees(values[..., self._angles], what)
        return values

    def fk(self, q: Any, link: str | None = None) -> Array:
        """Pose (..., 4, 4) of a link (the last by default) in the base link's frame.

        >>> Robot.from_dh([[0, 0, 1, 0]]).fk([np.pi / 2]).round(9)[:3, 3]
        array([0., 1., 0.])
        """
        values = self.coordinates(q, limits=False)
        bodies = self.tree.bodies(runs_last(values, 1))
        return homogeneous(self.tree.frame(bodies, self._link(link)), values.shape[:-1])

    def frames(self, q: Any) -> Array:
        """Poses (..., links, 4, 4) of all links, the base first, in the base link's frame.

        >>> Robot.from_dh([[0, 0, 1, 0]] * 2).frames([0.0, 0.0])[:, 0, 3]
        array([0., 1., 2.])
        """
        values = self.coordinates(q, limits=False)
        bodies = self.tree.bodies(runs_last(values, 1))
        poses = [self.tree.frame(bodies, link.name) for link in self.links]
        return np.stack([homogeneous(T, values.shape[:-1]) for T in poses], axis=-3)

    def jacobian(self, q: Any, link: str | None = None) -> Array:
        """Geometric Jacobian (..., 6, nv): (v, omega) of the link's origin, in base axes.

        >>> Robot.from_dh([[0, 0, 1, 0]]).jacobian([0.0])[:, 0]
        array([0., 1., 0., 0., 0., 1.])
        """
        values = self.coordinates(q, limits=False)
        bodies = self.tree.bodies(runs_last(values, 1))
        return runs_first(self.tree.jacobian(bodies, self._link(link)), values.shape[:-1])

    def ik(
        self,
        T: Any,
        q0: Any = None,
        *,
        link: str | None = None,
        mask: Any = None,
        tolerance: float = 1e-8,
        iterations: int = 40,
        restarts: int = 100,
        seed: int = 0,
        limits: bool = True,
        threads: int | None = None,
    ) -> IKResult:
        """Coordinates that bring a link (the last by default) to poses T (..., 4, 4) in the base.

        q0          (..., nq), where the search begins; None is home
        mask        what counts: None for the whole pose, "position", "pointing" (position and the
                    direction of the link's z axis), or six weights of (p_goal - p, rotation vector
                    of R_goal R'), in the axes of the base: each 0 or from a thousandth of the
                    largest on
        tolerance   of `error`, the larger of the metres and the radians that count
        iterations  of each search at most; it ends sooner where it is not worth going on. The last
                    one goes on from the best that was found, ten times as long if it has to
        restarts    how many more searches, from random coordinates, nearest pose first
        seed        of these; they are the same for every row
        limits      False to search without them
        threads     how many; None for one per processor. The result is the same for any number

        Damped least squares with a damping in proportion to the squared error (Chan and Lawrence
        1988; Sugihara 2011); joints at their limits are held there. What moves freely may take
        part, a vehicle not. A row has the same bits alone and in any batch. InputError: T is no
        pose, q0 does not fit, no joint moves the link, it rides on a vehicle.

        >>> arm = Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]], home=[0.1, 0.1])
        >>> found = arm.ik(Pose.at(1, 1, 0), mask="position")
        >>> bool(found.success), found.reason.name
        (True, 'SOLVED')
        """
        arm = self._arm(link, limits)
        start = self.home if q0 is None else self.coordinates(q0, "q0", limits=limits)
        effort = Effort.checked(tolerance, iterations, restarts, seed, threads)
        return solve(arm, T, start, mask, effort)

    def closed_ik(self, T: Any, *, link: str | None = None, tolerance: float = 1e-9) -> ClosedIK:
        """All solutions for poses T (..., 4, 4), where the arm has a closed form.

        Six joints with a spherical wrist have eight (Pieper 1968; Paul and Zhang 1986), five like
        those of the Rhino four (Schilling 1990, section 3.5); axes 2 and 3 are parallel, and axis
        1 is square to them. The arm is known by its geometry, not by its name. A solution is valid
        if the entries of its pose differ from T by no more than the tolerance. InputError: T is no
        pose, or the arm has no such form, and why.

        >>> a = np.pi / 2
        >>> rows = [[0, 0.3, 0, -a], [0, 0, 0.2, 0], [0, 0, 0.2, 0], [0, 0, 0, -a], [0, 0.1, 0, 0]]
        >>> arm = Robot.from_dh(rows)
        >>> found = arm.closed_ik(arm.fk([0.1, -1.0, 1.0, 0.5, 0.2]))
        >>> found.q.shape, found.q[0].round(9)
        ((4, 5), array([ 0.1, -1. ,  1. ,  0.5,  0.2]))
        """
        return solve_closed(self._arm(link, True), T, tolerance)

    def _arm(self, link: str | None, limits: bool) -> Arm:
        """What inverse kinematics has to know."""
        if not isinstance(limits, bool | np.bool_):
            raise InputError(f"limits must be True or False, got {limits!r:.80}")
        rows = self.limits if limits else np.tile([-np.inf, np.inf], (self.nq, 1))
        names = self.coordinate_units, self.velocity_names
        return Arm(self.tree, self._link(link), rows, self.home, *names)

    def integrate(self, q: Any, v: ArrayLike, dt: float) -> Array:
        """Coordinates (..., nq) after the velocity v (..., nv) was held for dt seconds: exact.

        A floating joint moves by T exp(V dt), a planar one or a unicycle along an arc, a car too,
        once it has steered; limits of coordinates are not looked at.

        >>> Robot.from_dh([[0, 0, 1, 0]]).integrate([0.1], [2.0], 0.5)
        array([1.1])
        """
        start, rate = self.coordinates(q, limits=False), numbers(v, "v", (self.nv,))
        lead = common_lead(start.shape[:-1], rate.shape[:-1], "q and v")
        moved = runs_last(np.broadcast_to(start, (*lead, self.nq)), 1).copy()
        rates = runs_last(np.broadcast_to(rate, (*lead, self.nv)), 1)
        self.tree.advance(moved, rates, float(numbers(dt, "dt", ())))
        return runs_first(moved, lead)

    def _link(self, name: str | None) -> str:
        names = [link.name for link in self.links]
        if name is not None and name not in names:
            raise FrameError(
                f"no frame {name!r} in robot '{self.name}'; {suggest(name, names, 'frames')}"
            )
        return name or self.tip

    @cached_property
    def _angles(self) -> list[int]:
        """Which coordinates are angles that people write by hand: not those of rolling wheels."""
        rolling = [isinstance(link.joint.follows, Rolling) for link in self._owners]
        units = zip(self.coordinate_units, rolling, strict=True)
        return [i for i, (unit, rolls) in enumerate(units) if unit == "rad" and not rolls]

    @property
    def _floats(self) -> bool:
        """Whether all that moves is one floating joint, so that a pose says everything."""
        return [k.joint.kind for k in self.links if k.joint.kind != "fixed"] == ["floating"]

    @property
    def _owners(self) -> list[Link]:
        """(nq,) the link whose joint has the coordinate."""
        return [link for link in self.links for _ in link.joint.parts.coordinates]

    def _check_ranges(self) -> None:
        """InputError if a coordinate and those that mimic it have no limits in common."""
        for name, (low, high) in zip(self.coordinate_names, self._ranges, strict=True):
            if low > high:
                raise InputError(
                    f"joint '{name}' of '{self.name}' and what mimics it are never within their "
                    "limits at once"
                )

    def _check_limits(self, q: Array, what: str) -> None:
        low, high = self._ranges[:, 0] - LIMIT_SLACK, self._ranges[:, 1] + LIMIT_SLACK
        outside = (q < low) | (q > high)
        if outside.any():
            where = tuple(int(i) for i in np.argwhere(outside)[0])
            name, (lo, hi) = self.coordinate_names[where[-1]], self._ranges[where[-1]]
            unit = self.coordinate_units[where[-1]]
            row = f" of row {where[:-1]}" if q.ndim > 1 else ""
            raise InputError(
                f"{what}{row}: joint '{name}' of '{self.name}' is {q[where]:.6g} {unit}, "
                f"outside its limits [{lo:.6g}, {hi:.6g}] {unit}"
            )


def _mimicked(
    link: Link, follows: Mapping[str, Any], number: Mapping[str, int]
) -> tuple[int, tuple[float, float]]:
    """The coordinate that a link mimics in the end, and what the link's limits are of that one.

    InputError if what is mimicked does not mimic, but follows in
    another way.
    """
    mimic: Any = link.joint.follows
    assert link.joint.limits is not None
    limits = link.joint.limits
    while isinstance(mimic, Mimic):
        limits = mimic.source_limits(limits)
        if mimic.of in number:
            return number[mimic.of], limits
        mimic = follows[mimic.of]
    raise InputError(
        f"limits of '{link.name}' are not looked at, because what it mimics follows by "
        f"{type(mimic).__name__}: limit '{mimic.of}'"
    )


def _spans(limits: ArrayLike, n: int) -> list[list[float]]:
    """(n, 2) limits; a joint without has (-inf, inf)."""
    given = np.asarray(limits)
    free = given == np.array([-np.inf, np.inf]) if given.shape == (n, 2) else np.False_
    spans = numbers(np.where(free, 0.0, given), "limits", (n, 2))
    return np.where(free, given, spans).tolist()  # type: ignore[no-any-return]


def _joint_kinds(joints: object, n: int) -> list[Literal["revolute", "prismatic"]]:
    if not isinstance(joints, str) or len(joints) != n or set(joints) - set("RP"):
        raise InputError(f"joints: expected {n} letters R or P, as in {'R' * n!r}, got {joints!r}")
    return ["revolute" if letter == "R" else "prismatic" for letter in joints]
