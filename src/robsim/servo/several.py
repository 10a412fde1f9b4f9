"""Several tasks at once: in strict order, one after the other, or side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.arrays import Array, frozen, positive, shown_view
from robsim.errors import InputError
from robsim.kernels.loop import Command
from robsim.scene import Scene
from robsim.servo.controller import Assessment, Controller, Decision, Servo
from robsim.servo.instant import Instant
from robsim.servo.law import JointLaw
from robsim.servo.redundancy import priorities
from robsim.servo.shaped import Columns, Shaped
from robsim.servo.shaping import Shaping
from robsim.servo.sight import Key, Sight
from robsim.servo.task import ServoTask, Task
from robsim.value import Value


@dataclass(frozen=True, eq=False)
class Priorities(Shaped):
    """Tasks in strict order: none disturbs one that comes before it (Siciliano and Slotine 1991).

    The first are served exactly as far as the robot can, each next within what is left; their own
    features, gains, depths and feed-forward count, their laws are all "joint". `rcond` decides
    what is left.

    >>> Priorities([ServoTask(features="points"), ServoTask(features="lines")]).rcond
    1e-06
    """

    kind: ClassVar[str] = "priorities"
    tasks: Any
    rcond: float = 1e-6

    def __post_init__(self) -> None:
        super().__post_init__()
        tasks = _tasks(self.tasks, 2)
        for task in tasks:
            if not isinstance(task, ServoTask) or type(task.law) is not JointLaw:
                raise InputError(
                    "priorities are for tasks such as IBVS, PBVS and Hybrid with law='joint', "
                    f"got {task!r:.80}"
                )
            if task.joints or task.secondary or task.smooth_start or task.limit:
                raise InputError(
                    "joints, secondary, smooth_start and limit belong to Priorities(...) as a "
                    "whole, not to one of its tasks"
                )
        object.__setattr__(self, "tasks", tasks)
        object.__setattr__(self, "rcond", positive(self.rcond, "rcond"))
        if self.rcond >= 1:
            raise InputError(f"rcond must be below 1, got {self.rcond}")

    def columns(self, scene: Scene) -> Columns:
        """All that any of the tasks commands."""
        return self.chosen(scene, _union(task.columns(scene) for task in self.tasks))

    def bind(self, scene: Scene, columns: Columns | None = None) -> Controller:
        """The controller of all tasks in a scene."""
        columns = self.columns(scene) if columns is None else columns
        parts = [task.bind(scene, columns) for task in self.tasks]
        for part in parts:
            if type(part.law) is not JointLaw:
                name = type(part.law).__name__
                raise InputError(f"priorities are for the joint law, and a task brings {name}")
        common = _common(parts) | {"rcond": self.rcond}
        shaping = self.shaping(scene, columns)
        return Ordered(**common, columns=columns, parts=tuple(parts), shaping=shaping)


@runtime_checkable
class Condition(Protocol):
    """When a switch is thrown: any object with this method."""

    def holds(self, first: Comparison, second: Comparison) -> Array:
        """(B,) truth values."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """What a condition sees of one of two schemes: its features, error and command, run first."""

    s_last: Array
    error_last: Array
    qd_last: Array
    pixels_last: Array  # (N, 2, B) of all its marks, as measured

    @property
    def s(self) -> Array:
        """(B, k)."""
        return shown_view(self.s_last)

    @property
    def error(self) -> Array:
        """(B, k) s - s_goal."""
        return shown_view(self.error_last)

    @property
    def qd(self) -> Array:
        """(B, n) commanded velocities."""
        return shown_view(self.qd_last)

    @property
    def pixels(self) -> Array:
        """(B, N, 2)."""
        return shown_view(self.pixels_last)


@dataclass(frozen=True)
class ErrorBelow:
    """When the largest |e| of the first scheme (or the second) is below a value.

    >>> ErrorBelow(0.05).of
    'first'
    """

    value: float
    of: str = "first"

    def __post_init__(self) -> None:
        object.__setattr__(self, "value", positive(self.value, "error below"))
        if self.of not in ("first", "second"):
            raise InputError(f"of must be 'first' or 'second', got {self.of!r:.80}")

    def holds(self, first: Comparison, second: Comparison) -> Array:
        """(B,)."""
        chosen = first if self.of == "first" else second
        below: Array = np.abs(chosen.error_last).max(axis=0) < self.value
        return below


@dataclass(frozen=True)
class NearBorder:
    """When a mark is within `margin` pixels of the border of an image of `size` (width, height).

    >>> NearBorder(20, (640, 480)).margin
    20.0
    """

    margin: float
    size: tuple[int, int]

    def __post_init__(self) -> None:
        object.__setattr__(self, "margin", positive(self.margin, "margin (pixels)"))
        if not isinstance(self.size, Sequence | np.ndarray) or len(self.size) != 2:
            raise InputError(f"size: expected (width, height) in pixels, got {self.size!r:.80}")
        width, height = (positive(n, "size (pixels)") for n in self.size)
        object.__setattr__(self, "size", (int(width), int(height)))

    def holds(self, first: Comparison, second: Comparison) -> Array:
        """(B,)."""
        room = np.array(self.size)[:, None] - 1 - first.pixels_last
        near: Array = np.minimum(first.pixels_last, room).min(axis=(0, 1)) < self.margin
        return near


@dataclass(frozen=True, eq=False)
class Switch(Value):
    """The first scheme, and from when a condition holds the second: PBVS far away, IBVS near.

    when    `ErrorBelow(value)`, `NearBorder(margin, size)`, or any object with
            holds(first, second) -> (B,)
    latch   stay with the second; otherwise it is asked anew at every instant (a switched system as
            in Gans and Hutchinson 2007)

    A run has converged when the errors of both are small: their goals must be one.

    >>> Switch(ServoTask(), ServoTask(features="pixels"), ErrorBelow(0.1)).latch
    True
    """

    kind: ClassVar[str] = "switch"
    first: Any
    second: Any
    when: Any
    latch: bool = True

    def __post_init__(self) -> None:
        _tasks([self.first, self.second], 2)
        if isinstance(self.when, type) or not isinstance(self.when, Condition):
            raise InputError(
                "when: expected ErrorBelow(value), NearBorder(margin, size) or an object with "
                f"holds(first, second), got {self.when!r:.80}"
            )
        if not isinstance(self.latch, bool):
            raise InputError(f"latch must be True or False, got {self.latch!r:.80}")

    def columns(self, scene: Scene) -> Columns:
        """All that one of the two commands."""
        return _union([self.first.columns(scene), self.second.columns(scene)])

    def bind(self, scene: Scene, columns: Columns | None = None) -> Controller:
        """The controller of both in a scene, each with its own joints."""
        mine = self.columns(scene)
        parts = [task.bind(scene, task.columns(scene)) for task in (self.first, self.second)]
        return Switched(
            **_common(parts), columns=mine, parts=tuple(parts), when=self.when, latch=self.latch
        )


@dataclass(frozen=True, eq=False)
class Together(Value):
    """Tasks side by side, each with joints of its own: a head that watches, an arm that works.

    Give each task its `joints` where the cameras and targets would let them share some.

    >>> Together([ServoTask(joints="head"), ServoTask(joints="arm")]).tasks[0].joints
    ('head',)
    """

    kind: ClassVar[str] = "together"
    tasks: Any

    def __post_init__(self) -> None:
        object.__setattr__(self, "tasks", _tasks(self.tasks, 2))

    def columns(self, scene: Scene) -> Columns:
        """All of them; InputError if two tasks command one joint."""
        each = [task.columns(scene) for task in self.tasks]
        every, counts = np.unique(np.concatenate(each), return_counts=True)
        if (counts > 1).any():
            names = ", ".join(scene.velocity_names[i] for i in every[counts > 1])
            raise InputError(
                f"two tasks command one joint: {names}; tell them apart with joints=..., or put "
                "them in order with Priorities"
            )
        return frozen(every)

    def bind(self, scene: Scene, columns: Columns | None = None) -> Controller:
        """The controller of all of them in a scene."""
        mine = self.columns(scene)
        parts = [task.bind(scene, task.columns(scene)) for task in self.tasks]
        return Beside(**_common(parts), columns=mine, parts=tuple(parts))


SEVERAL: dict[str, type[Any]] = {each.kind: each for each in (Priorities, Switch, Together)}


@dataclass(frozen=True, eq=False)
class Ordered(Controller):
    """In strict order."""

    parts: tuple[Servo, ...]
    shaping: Shaping

    def decide(self, now: Instant) -> Decision:
        """Each within what those before it leave free."""
        each = [part.assess(now.inside(str(i))) for i, part in enumerate(self.parts)]
        states = [one.state for one in each]
        levels = [(s.reach_last, -s.times_gain(s.error_last)) for s in states]
        qd, _ = priorities(levels, self.rcond)
        s, error, reach = (
            np.concatenate(parts)
            for parts in zip(*((a.measured.s, a.error, a.reach) for a in each), strict=True)
        )
        J = each[0].measured.J
        if not self.shaping.idle:
            qd = self.shaping.shaped(now, qd, reach, error, J)
        return Decision(Command(s, error, qd, reach), J, each)

    def note(self, now: Instant, basis: list[Assessment], qd: Array) -> None:
        """Each remembers what was commanded in the end."""
        for i, (part, one) in enumerate(zip(self.parts, basis, strict=True)):
            part.note(now.inside(str(i)), one, qd)


@dataclass(frozen=True, eq=False)
class Several(Controller):
    """Tasks with joints of their own, which they may share."""

    parts: tuple[Controller, ...]

    def note(self, now: Instant, basis: list[Decision], qd: Array) -> None:
        """Each remembers what was commanded of its joints in the end."""
        for i, (part, one) in enumerate(zip(self.parts, basis, strict=True)):
            part.note(now.inside(str(i)), one.basis, qd[self._own(part)])

    def _own(self, part: Controller) -> Columns:
        """Where the velocities of a part are among all that are commanded."""
        return np.searchsorted(self.columns, part.columns)

    def _all(self, now: Instant) -> tuple[list[Decision], Array, Array, Array]:
        """What each decides; and s, error, and reach of all joints, stacked."""
        each = [part.decide(now.inside(str(i))) for i, part in enumerate(self.parts)]
        reach, row = np.zeros((self.k, self.columns.size, now.runs)), 0
        for part, one in zip(self.parts, each, strict=True):
            reach[row : row + part.k, self._own(part)] = one.command.reach
            row += part.k
        s, error = (np.concatenate([getattr(d.command, n) for d in each]) for n in ("s", "error"))
        return each, s, error, reach


@dataclass(frozen=True, eq=False)
class Switched(Several):
    """One after the other."""

    when: Condition
    latch: bool

    def decide(self, now: Instant) -> Decision:
        """The command of the one whose turn it is; joints that are the other's stand still."""
        each, s, error, reach = self._all(now)
        second, qd = self._thrown(now, each), np.zeros((self.columns.size, now.runs))
        for part, one, turn in zip(self.parts, each, (~second, second), strict=True):
            qd[self._own(part)] += np.where(turn, one.command.qd, 0.0)
        return Decision(Command(s, error, qd, reach), each[0].J, each)

    def _thrown(self, now: Instant, each: list[Decision]) -> NDArray[np.bool_]:
        """(B,): which runs are with the second."""
        seen = [self._comparison(now, part, d) for part, d in zip(self.parts, each, strict=True)]
        thrown = _truths(self.when, seen, now.runs)
        if self.latch:
            thrown = thrown | now.memory.get("thrown", False)
            now.memory["thrown"] = thrown
        return thrown

    def _comparison(self, now: Instant, part: Controller, one: Decision) -> Comparison:
        pixels = np.concatenate([now.pixels[sight.key] for sight in part.sights])
        command = one.command
        return Comparison(command.s, command.error, command.qd, pixels)


@dataclass(frozen=True, eq=False)
class Beside(Several):
    """Side by side."""

    def decide(self, now: Instant) -> Decision:
        """Each commands its own joints."""
        each, s, error, reach = self._all(now)
        qd = np.empty((self.columns.size, now.runs))
        for part, one in zip(self.parts, each, strict=True):
            qd[self._own(part)] = one.command.qd
        return Decision(Command(s, error, qd, reach), each[0].J, each)


def _truths(when: Condition, seen: Sequence[Comparison], runs: int) -> NDArray[np.bool_]:
    """(B,) from a condition, which may be the user's."""
    value = when.holds(*seen)
    try:
        holds: NDArray[Any] = np.asarray(value)
    except ValueError:  # rows of unequal lengths
        holds = np.empty(())
    if holds.shape != (runs,) or holds.dtype != np.bool_:
        raise InputError(
            f"{type(when).__name__}.holds: expected truth values of shape ({runs},), "
            f"got {value!r:.80}"
        )
    return holds


def _common(parts: Sequence[Controller]) -> dict[str, Any]:
    """What the parts make together."""
    sights: dict[Key, Sight] = {}
    pixels: dict[Key, Array] = {}
    for part in parts:
        start = 0
        for sight in part.sights:
            marks = len(sight.target.marks)
            sights.setdefault(sight.key, sight)
            pixels.setdefault(sight.key, part.goal_pixels[start : start + marks])
            start += marks
    return {
        "sights": tuple(sights.values()),
        "s_goal": np.concatenate([part.s_goal for part in parts]),
        "units": tuple(unit for part in parts for unit in part.units),
        "tolerances": np.concatenate([part.tolerances for part in parts]),
        "goal_pixels": np.concatenate(list(pixels.values())),
        "pace": min(part.pace for part in parts),
        "full_rank": max(part.full_rank for part in parts),
        "rcond": min(part.rcond for part in parts),
    }


def _tasks(given: Any, least: int) -> tuple[Task, ...]:
    tasks = tuple(given) if isinstance(given, list | tuple) else ()
    if len(tasks) < least or not all(
        isinstance(t, Task) and not isinstance(t, type) for t in tasks
    ):
        raise InputError(
            f"expected at least {least} tasks such as IBVS(...) and PBVS(...), got {given!r:.80}"
        )
    return tasks


def _union(columns: Any) -> Columns:
    return frozen(np.unique(np.concatenate(list(columns))))
