"""The scene: robots, objects and cameras on one kinematic tree that hangs from the world."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen, numbers, runs_last
from robsim.base.errors import FrameError, InputError, suggest
from robsim.base.names import checked_name
from robsim.base.values import Value
from robsim.geometry.pose import IDENTITY, Pose, homogeneous, one_pose
from robsim.robot.assembly import Frame
from robsim.robot.joint import FIXED, Joint
from robsim.robot.link import checked_shapes
from robsim.robot.robot import Robot
from robsim.robot.tree import Tree
from robsim.vision.camera import Camera
from robsim.world import overview
from robsim.world.motion import Motion

T = TypeVar("T", Robot, "Object", "MountedCamera", Motion)


@dataclass(frozen=True, eq=False)
class Object(Value):
    """A thing in the scene: shapes to draw and `marks` (N, 3) to look at, in its own axes.

    It stands at `pose` on the frame `on`: "world", another object, or a link such as
    "rhino_xr4.tool". Without marks given, the vertices of its shapes are its marks.

    >>> from robsim.geometry.primitives import Block
    >>> Object("cube", Block(0.05, 0.05, 0.05)).marks.shape
    (8, 3)
    """

    name: str
    shapes: Any = ()
    marks: Any = None
    pose: Pose = IDENTITY
    on: str = "world"

    def __post_init__(self) -> None:
        checked_name(self.name, "object")
        shapes = checked_shapes(self.shapes, f"object '{self.name}'")
        marks = self.marks
        if marks is None:
            marks = np.concatenate([np.empty((0, 3)), *(shape.vertices for shape in shapes)])
        marks = numbers(marks, f"marks of '{self.name}'", ("N", 3))
        if marks.ndim != 2:
            raise InputError(f"marks of '{self.name}': expected shape (N, 3), got {marks.shape}")
        object.__setattr__(self, "shapes", shapes)
        object.__setattr__(self, "marks", frozen(marks))
        object.__setattr__(self, "pose", one_pose(self.pose, f"pose of '{self.name}'"))


@dataclass(frozen=True)
class MountedCamera:
    """A camera in the scene, its axes at `pose` (the hand-eye pose) on the frame `on`.

    >>> MountedCamera("eye", Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]), on="arm.tool").on
    'arm.tool'
    """

    name: str
    camera: Camera
    on: str = "world"
    pose: Pose = IDENTITY

    def __post_init__(self) -> None:
        checked_name(self.name, "camera")
        if not isinstance(self.camera, Camera):
            raise InputError(f"camera '{self.name}' needs a Camera, got {self.camera!r:.80}")
        object.__setattr__(self, "pose", one_pose(self.pose, f"pose of '{self.name}'"))


class View(NamedTuple):
    """What a camera sees: pixels (..., N, 2), depth (..., N) in metres, `Visibility` (..., N)."""

    pixels: Array
    depth: Array
    visibility: NDArray[np.int8]


@dataclass(frozen=True)
class Scene:
    """Robots, objects and cameras. Frames are called "world", "robot.link", and by name.

    `motions` say which robots move on their own. `display` is the chapter's gT0: the pose of the
    world in the frame of the figures.
    Coordinates q of the scene are those of its robots, one after the other.

    >>> arm = Robot.from_dh([[0, 0, 1, 0]], name="arm")
    >>> lens = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    >>> eye = MountedCamera("eye", lens, on="arm.link1")
    >>> scene = Scene([arm], [Object("dot", marks=[[1, 0, 2]])], [eye])
    >>> scene.view([0.0], points="dot").pixels
    array([[320., 240.]])
    """

    robots: tuple[Robot, ...] = ()
    objects: tuple[Object, ...] = ()
    cameras: tuple[MountedCamera, ...] = ()
    motions: tuple[Motion, ...] = ()
    display: Pose = field(default=IDENTITY, kw_only=True)

    def __post_init__(self) -> None:
        for kind, part in _KINDS.items():
            given = getattr(self, kind)
            parts = (given,) if isinstance(given, part) else given
            if not isinstance(parts, Iterable) or not all(isinstance(p, part) for p in parts):
                raise InputError(f"{kind} must be a list of {part.__name__}, got {given!r:.80}")
            object.__setattr__(self, kind, tuple(parts))
        object.__setattr__(self, "display", one_pose(self.display, "display"))
        names = ["world", *(part.name for part in self._parts)]
        twice = sorted({n for n in names if names.count(n) > 1})
        if twice:
            raise InputError(f"two things in the scene are called '{twice[0]}'; rename one")
        _ = self.tree  # an unknown frame is an error now, not later
        for motion in self.motions:
            motion.check(self.robot(motion.robot).nv)
        movers = [motion.robot for motion in self.motions]
        if len(set(movers)) < len(movers):
            raise InputError(f"two motions for one robot: {', '.join(movers)}")

    def __repr__(self) -> str:
        """Return a few lines, one for each thing."""
        return overview.text(self)

    def _repr_html_(self) -> str:
        """Return a table of all things for notebooks."""
        return overview.table(self)

    @cached_property
    def tree(self) -> Tree:
        """All frames; coordinates come in the order of the robots."""
        return Tree(self._frames())

    @property
    def nq(self) -> int:
        """How many coordinates."""
        return sum(robot.nq for robot in self.robots)

    @property
    def nv(self) -> int:
        """How many velocities."""
        return sum(robot.nv for robot in self.robots)

    @property
    def home(self) -> Array:
        """All robots at home."""
        return np.concatenate([np.empty(0), *(robot.home for robot in self.robots)])

    @property
    def limits(self) -> Array:
        """(nq, 2)."""
        return np.concatenate([np.empty((0, 2)), *(robot.limits for robot in self.robots)])

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """Those of the robot; with its name in front where there are several."""
        return self._labels("coordinate_names")

    @property
    def coordinate_units(self) -> tuple[str, ...]:
        """ "rad", "m", or "1" of each coordinate."""
        return tuple(unit for robot in self.robots for unit in robot.coordinate_units)

    @property
    def velocity_names(self) -> tuple[str, ...]:
        """Those of the robot; with its name in front where there are several."""
        return self._labels("velocity_names")

    @property
    def velocity_units(self) -> tuple[str, ...]:
        """ "rad/s" or "m/s" of each velocity."""
        return tuple(unit for robot in self.robots for unit in robot.velocity_units)

    @cached_property
    def prescribed(self) -> NDArray[np.bool_]:
        """(nv,): which velocities no task commands, because their robot moves on its own."""
        movers = {motion.robot for motion in self.motions}
        flags = [np.full(robot.nv, robot.name in movers) for robot in self.robots]
        return frozen(np.concatenate([np.empty(0, dtype=np.bool_), *flags]))

    def drift(self, seconds: float) -> Array:
        """(nv,) prescribed velocities at a time; zero for all others."""
        motions = {motion.robot: motion for motion in self.motions}
        each = [
            motions[robot.name].check(robot.nv, seconds)
            if robot.name in motions
            else np.zeros(robot.nv)
            for robot in self.robots
        ]
        return frozen(np.concatenate([np.empty(0), *each]))

    def robot(self, name: str | None = None) -> Robot:
        """The robot of that name, or the only one."""
        return _pick(self.robots, name, "robot")

    def object(self, name: str | None = None) -> Object:
        """The object of that name, or the only one that has marks."""
        candidates = self.objects if name else tuple(o for o in self.objects if len(o.marks))
        return _pick(candidates, name, "object")

    def camera(self, name: str | None = None) -> MountedCamera:
        """The camera of that name, or the only one."""
        return _pick(self.cameras, name, "camera")

    def replacing(self, *parts: Robot | Object | MountedCamera | Motion) -> Scene:
        """A copy in which these parts replace those of the same name: a belief, for example.

        >>> scene = Scene(objects=Object("cup", marks=[[0, 0, 0]]))
        >>> moved = Object("cup", marks=[[0, 0, 0]], pose=Pose.at(1, 0, 0))
        >>> scene.replacing(moved).pose("cup").position
        array([1., 0., 0.])
        """
        changed: dict[str, Any] = {kind: list(getattr(self, kind)) for kind in _KINDS}
        for part in parts:
            kind = next((kind for kind in _KINDS if isinstance(part, _KINDS[kind])), None)
            if kind is None:
                raise InputError(
                    f"expected a Robot, Object, MountedCamera or Motion, got {part!r:.80}"
                )
            known = [p.name for p in changed[kind]]
            if part.name not in known:
                raise InputError(
                    f"the scene has no {kind[:-1]} '{part.name}' to replace; "
                    f"{suggest(part.name, known, kind)}"
                )
            changed[kind][known.index(part.name)] = part
        return replace(self, **changed)

    def attached(self, name: str, to: str, q: Any = None) -> Scene:
        """A copy in which an object hangs from the frame `to`, and stays where it is at q (nq,).

        From then on it rides with that frame: a gripper has closed on it, or it lies on a pallet.

        >>> arm = Robot.from_dh([[0, 0, 1, 0]], name="arm")
        >>> scene = Scene([arm], Object("cup", marks=[[0, 0, 0]], pose=Pose.at(1, 0, 0)))
        >>> held = scene.attached("cup", "arm.link1", q=[0.0])
        >>> held.pose("cup", [np.pi / 2]).position.round(9)
        array([0., 1., 0.])
        """
        thing = self.object(name)
        values = self.coordinates(self.home if q is None else q, limits=False)
        if values.ndim != 1:
            raise InputError(
                f"q: '{name}' changes hands at one state ({self.nq},), got {values.shape}"
            )
        self._check_hanging(thing, to)
        there = self.pose(to, values).inv() @ self.pose(thing.name, values)
        return self.replacing(replace(thing, pose=Pose(there.matrix), on=to))

    def released(self, name: str, q: Any = None) -> Scene:
        """A copy in which an object stands in the world, where it is at q (nq,).

        >>> arm = Robot.from_dh([[0, 0, 1, 0]], name="arm")
        >>> scene = Scene([arm], Object("cup", marks=[[0, 0, 0]], on="arm.link1"))
        >>> scene.released("cup", q=[0.0]).pose("cup", [1.0]).position
        array([1., 0., 0.])
        """
        return self.attached(name, "world", q)

    def coordinates(self, q: Any, what: str = "q", limits: bool = True) -> Array:
        """Checked q (..., nq): an array, or {robot: q} where the robots left out stay at home."""
        if isinstance(q, Mapping):
            for name in q:
                self.robot(name)
            parts = [r.coordinates(q.get(r.name, r.home), what, limits) for r in self.robots]
            sizes = [p.shape[:-1] for p in parts]
            try:
                lead = np.broadcast_shapes(*sizes)
            except ValueError:
                raise InputError(f"{what}: batches of unequal shapes {sizes}") from None
            wide = [np.broadcast_to(p, (*lead, p.shape[-1])) for p in parts]
            return np.concatenate([np.empty((*lead, 0)), *wide], -1)
        if len(self.robots) == 1:
            return self.robots[0].coordinates(q, what, limits)
        values = numbers(q, what, (self.nq,))
        start = 0
        for robot in self.robots:
            robot.coordinates(values[..., start : start + robot.nq], what, limits)
            start += robot.nq
        return values

    def pose(self, frame: str, q: Any = None) -> Pose:
        """Where a frame stands in the world."""
        values = self.coordinates(self.home if q is None else q, limits=False)
        T = self.tree.frame(self.tree.bodies(runs_last(values, 1)), frame)
        return Pose(homogeneous(T, values.shape[:-1]), ("world", frame))

    def view(self, q: Any = None, camera: str | None = None, points: Any = None) -> View:
        """What a camera sees of points: an object's marks (by name) or world points (N, 3).

        >>> eye = MountedCamera("eye", Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]))
        >>> Scene(cameras=eye).view(points=[[0, 0, 2]]).depth
        array([2.])
        """
        eye = self.camera(camera)
        T_w_c = Pose(self.pose(eye.name, q).matrix)
        if points is None or isinstance(points, str):
            thing = self.object(points)
            marks = Pose(self.pose(thing.name, q).matrix) @ thing.marks
        else:
            marks = numbers(points, "points", ("N", 3))
        depth = np.asarray(T_w_c.inv() @ marks)[..., 2]
        return View(eye.camera.project(marks, T_w_c), depth, eye.camera.visibility(marks, T_w_c))

    @property
    def _parts(self) -> tuple[Robot | Object | MountedCamera, ...]:
        return (*self.robots, *self.objects, *self.cameras)

    def _check_hanging(self, thing: Object, to: Any) -> None:
        """InputError if there is no frame `to`, or if it hangs from the object itself."""
        above = {frame.name: frame.parent for frame in self._frames()}
        known = ["world", *above]
        if not isinstance(to, str) or to not in known:
            raise FrameError(f"no frame {to!r:.80}; {suggest(to, known, 'frames')}")
        frame = to
        while frame != "world":
            if frame == thing.name:
                way = "itself" if to == frame else f"'{to}', which stands on it"
                raise FrameError(f"'{thing.name}' cannot hang from {way}")
            frame = above[frame]

    def _frames(self) -> list[Frame]:
        frames = []
        for robot in self.robots:
            for i, link in enumerate(robot.links):
                joint = link.joint.within(robot.name)
                if not i:
                    joint = _fixed(robot.base @ link.joint.place @ link.joint.tail)
                parent = f"{robot.name}.{link.parent}" if i else robot.on
                frames.append(Frame(f"{robot.name}.{link.name}", parent, joint))
        hung: tuple[Object | MountedCamera, ...] = (*self.objects, *self.cameras)
        for part in hung:
            frames.append(Frame(part.name, part.on, _fixed(part.pose)))
        return frames

    def _labels(self, which: str) -> tuple[str, ...]:
        if len(self.robots) == 1:
            return tuple(getattr(self.robots[0], which))
        return tuple(f"{r.name}.{name}" for r in self.robots for name in getattr(r, which))


_KINDS: dict[str, type[Any]] = {
    "robots": Robot,
    "objects": Object,
    "cameras": MountedCamera,
    "motions": Motion,
}


def _fixed(pose: Pose) -> Joint:
    return replace(FIXED, place=pose)


def _pick(parts: Sequence[T], name: str | None, kind: str) -> T:
    names = [p.name for p in parts]
    if name is None and not parts:
        lack = " with marks" if kind == "object" else ""
        raise InputError(f"the scene has no {kind}{lack}")
    if name is None and len(parts) == 1:
        return parts[0]
    if name is None:
        raise InputError(f"name the {kind}: the scene has {len(parts)} ({', '.join(names)})")
    if name not in names:
        raise InputError(f"no {kind} {name!r} in the scene; {suggest(name, names, kind + 's')}")
    return parts[names.index(name)]
