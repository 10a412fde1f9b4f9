"""The kinematic tree: links and joints, folded into the constants that the kernels need."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from robsim.arrays import Array, frozen, numbers
from robsim.errors import FrameError, InputError, suggest
from robsim.kernels import tree as kernels
from robsim.pose import IDENTITY, Pose, one_pose

Kind = Literal["fixed", "revolute", "prismatic", "floating", "planar", "unicycle"]
_CODE = {
    "revolute": kernels.REVOLUTE,
    "prismatic": kernels.PRISMATIC,
    "floating": kernels.FLOATING,
    "planar": kernels.PLANAR,
    "unicycle": kernels.UNICYCLE,
}
# the velocities of a joint, in order: (about an axis, which axis of the moving frame)
_VELOCITIES: dict[str, list[tuple[bool, int]]] = {
    "fixed": [],
    "revolute": [(True, 2)],
    "prismatic": [(False, 2)],
    "floating": [(turns, axis) for turns in (False, True) for axis in range(3)],
    "planar": [(False, 0), (False, 1), (True, 2)],
    "unicycle": [(False, 0), (True, 2)],
}
COORDINATE_UNITS = {
    "fixed": [],
    "revolute": ["rad"],
    "prismatic": ["m"],
    "floating": ["m"] * 3 + ["1"] * 4,
    "planar": ["m", "m", "rad"],
    "unicycle": ["m", "m", "rad"],
}
# what follows the name of the link, where a joint has several
COORDINATE_NAMES: dict[str, tuple[str, ...]] = {
    "fixed": (),
    "revolute": ("",),
    "prismatic": ("",),
    "floating": (".x", ".y", ".z", ".qx", ".qy", ".qz", ".qw"),
    "planar": (".x", ".y", ".theta"),
    "unicycle": (".x", ".y", ".theta"),
}
VELOCITY_NAMES: dict[str, tuple[str, ...]] = {
    "fixed": (),
    "revolute": ("",),
    "prismatic": ("",),
    "floating": (".vx", ".vy", ".vz", ".wx", ".wy", ".wz"),
    "planar": (".vx", ".vy", ".omega"),
    "unicycle": (".v", ".omega"),
}
COORDINATES = {kind: len(units) for kind, units in COORDINATE_UNITS.items()}
VELOCITIES = {kind: len(rows) for kind, rows in _VELOCITIES.items()}
VELOCITY_UNITS = {
    kind: ["rad/s" if turns else "m/s" for turns, _ in rows] for kind, rows in _VELOCITIES.items()
}


@dataclass(frozen=True)
class Joint:
    """place . motion(q) . tail: a constant pose, a motion, a constant pose.

    A revolute joint turns about z and a prismatic one slides along it. A floating joint moves
    freely, a planar one in the plane z = 0, and so does a unicycle, which cannot move sideways.
    `limits` is (lowest, highest) in radians or metres, None for none.

    >>> Joint("prismatic", limits=(0.0, 0.5)).limits
    (0.0, 0.5)
    """

    kind: Kind = "fixed"
    place: Pose = IDENTITY
    tail: Pose = IDENTITY
    limits: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.kind, str) or self.kind not in COORDINATES:
            raise InputError(
                f"no joint kind {self.kind!r}; {suggest(self.kind, COORDINATES, 'kinds')}"
            )
        for part in ("place", "tail"):
            object.__setattr__(self, part, one_pose(getattr(self, part), f"joint {part}"))
        if self.limits is not None:
            if numbers(self.limits, "joint limits", (2,)).ndim != 1:
                raise InputError(f"joint limits must be (lowest, highest), got {self.limits}")
            if COORDINATES[self.kind] != 1:
                raise InputError(f"a {self.kind} joint has no limits, got {self.limits}")
            low, high = self.limits
            if not (np.isfinite([low, high]).all() and low < high):
                raise InputError(f"joint limits must be (lowest, highest), got {self.limits}")


FIXED = Joint()


@dataclass(frozen=True)
class Frame:
    """One frame of the tree: it hangs from `parent` by `joint`."""

    name: str
    parent: str
    joint: Joint


class Tree:
    """Constants of a tree of frames, in the kernels' form. Body 0 is the world.

    A moving joint starts a new body; its tail and every fixed joint behind it are folded into
    constant offsets, so that only joints that move cost anything.
    """

    def __init__(self, frames: Iterable[Frame]):
        declared = list(frames)
        first = _first_indices(declared)  # coordinates keep the declared order
        self.nq, self.nv = first.pop(None)
        self.where: dict[str, tuple[int, Array]] = {"world": (0, IDENTITY.matrix)}
        parent, kind, iq, iv, place = [0], [0], [0], [0], [np.eye(4)]
        body, angular, axis = np.zeros((3, self.nv), dtype=np.int64)
        for frame in _parents_first(declared):
            above, offset = self.find(frame.parent)
            joint = frame.joint
            start = offset @ joint.place.matrix
            if joint.kind == "fixed":
                self.where[frame.name] = (above, frozen(start @ joint.tail.matrix))
                continue
            n, m = first[frame.name]
            for i, (turns, along) in enumerate(_VELOCITIES[joint.kind]):
                body[m + i], angular[m + i], axis[m + i] = len(parent), turns, along
            self.where[frame.name] = (len(parent), joint.tail.matrix)
            parent.append(above)
            kind.append(_CODE[joint.kind])
            iq.append(n)
            iv.append(m)
            place.append(start)
        self.body, self.axis = _integers(body), _integers(axis)
        self.angular = frozen(angular.astype(np.bool_))
        places = frozen(np.ascontiguousarray(np.stack(place)[:, :3]))
        self.joints = kernels.Joints(
            _integers(parent), _integers(kind), _integers(iq), _integers(iv), places
        )

    def find(self, name: str) -> tuple[int, Array]:
        """The body that carries a frame, and the frame's constant pose in it."""
        if name not in self.where:
            raise FrameError(f"no frame {name!r}; {suggest(name, self.where, 'frames')}")
        return self.where[name]

    def bodies(self, q: Array) -> Array:
        """M[i, 3, 4, b] of coordinates q[n, b]."""
        joints = self.joints
        M = np.empty((len(joints.parent), 3, 4, q.shape[1]))
        kernels.bodies(joints.parent, joints.kind, joints.iq, joints.place, q, M)
        return M

    def frame(self, M: Array, name: str) -> Array:
        """T[3, 4, b] of a frame."""
        body, offset = self.find(name)
        T = np.empty(M.shape[1:])
        kernels.frame(M, body, offset, T)
        return T

    def jacobian(self, M: Array, name: str) -> Array:
        """J[6, j, b] of a frame's origin in world axes."""
        J = np.empty((6, self.nv, M.shape[3]))
        point = np.ascontiguousarray(self.frame(M, name)[:, 3])
        kernels.jacobian(M, point, self.body, self.angular, self.axis, self.carries(name), J)
        return J

    def carries(self, name: str) -> Array:
        """1.0 for each velocity that moves the frame, else 0.0."""
        carried: Array = self._ancestry[self.find(name)[0]]
        return carried

    @cached_property
    def _ancestry(self) -> Array:
        """[body, j]: whether velocity j carries the body."""
        parent = self.joints.parent
        rows = np.zeros((len(parent), self.nv))
        for i in range(1, len(parent)):
            rows[i] = rows[parent[i]] + (self.body == i)
        return frozen(rows)


def _integers(values: ArrayLike) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    return frozen(np.array(values, dtype=np.int64))


def _first_indices(frames: list[Frame]) -> dict[str | None, tuple[int, int]]:
    """Of each frame, its first coordinate and velocity; under None, how many there are."""
    first: dict[str | None, tuple[int, int]] = {}
    nq = nv = 0
    for frame in frames:
        if frame.name in first or frame.name == "world":
            raise FrameError(f"two frames are called '{frame.name}'")
        first[frame.name] = (nq, nv)
        nq, nv = nq + COORDINATES[frame.joint.kind], nv + VELOCITIES[frame.joint.kind]
    return {**first, None: (nq, nv)}


def _parents_first(frames: list[Frame]) -> list[Frame]:
    """The same frames, each after the one it hangs from."""
    placed, waiting, order = {"world"}, list(frames), []
    while waiting:
        ready = [f for f in waiting if f.parent in placed]
        if not ready:
            lost, names = waiting[0], ["world", *(f.name for f in frames)]
            if lost.parent in names:
                raise FrameError(f"'{lost.name}' hangs from itself, through '{lost.parent}'")
            raise FrameError(
                f"'{lost.name}' stands on '{lost.parent}', and there is no such frame; "
                f"{suggest(lost.parent, names, 'frames')}"
            )
        order += ready
        placed |= {f.name for f in ready}
        waiting = [f for f in waiting if f.name not in placed]
    return order
