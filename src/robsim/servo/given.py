"""The rows of a program that a controller is given, and those that it writes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from robsim.kernels.images import viewing
from robsim.kernels.machine.program import Blocks, Program
from robsim.robot.placed import Placed
from robsim.servo.sight import Key, Sight


@dataclass(frozen=True)
class View:
    """The rows of a camera and its target, and of the marks in its image."""

    T_w_c: int
    T_w_o: int
    pixels: int  # 2 for each mark
    depth: int
    hidden: int = -1  # whether each mark is hidden, where marks may be


@dataclass(frozen=True)
class Given:
    """The rows that a controller is given: coordinates, and marks as measured."""

    program: Program
    dt: int
    seconds: float  # dt
    q: int  # coordinates as measured
    views: dict[Key, View]  # of the true scene, with pixels and depths as measured
    placed: Placed | None = None  # the true scene, where it is as measured
    path: tuple[str, ...] = ()  # of the task among several, for what Python code remembers
    age: int = -1  # of the images in periods, rounded up; -1: they are always new
    released: int = -1  # 1 while the robot may move; -1: it always may

    @property
    def hides(self) -> bool:
        """Whether marks may be hidden."""
        return any(view.hidden >= 0 for view in self.views.values())

    def inside(self, name: str) -> Given:
        """Return the same for one of several tasks."""
        return replace(self, path=(*self.path, name))

    def memory(self, blocks: Blocks) -> dict[str, Any]:
        """Return what Python code of the task remembers of the runs of some blocks."""
        memory = blocks.memory
        for name in self.path:
            memory = memory.setdefault(name, {})
        return memory


@dataclass(frozen=True)
class Commanded:
    """The rows that a controller writes.

    `decide` returns from blocks what was decided, with all that it is based on; `note` adds the
    stages that remember the velocities, in rows, that were commanded in the end. Rows of what there
    is not are -1: of weights, and of the status of images whose marks need not all be seen.
    """

    s: int  # k
    error: int  # k
    qd: int  # n, of the commanded velocities
    task_jacobian: int  # k n
    busy: int  # 1 where a run may not end because it has converged or stalls
    decide: Callable[[Any], Any]
    note: Callable[[int], None]
    weights: int = -1  # k, how much each number of s counts
    status: int = -1  # that of a mark out of the image, where too few are left to command


def alone(
    program: Program, sights: Sequence[Sight], nq: int, dt: float, hides: bool = False
) -> Given:
    """Return the rows of coordinates and of what cameras see, which are written by hand."""
    q, views = program.rows(nq), {}
    for sight in sights:
        N = len(sight.target.marks)
        hidden = program.rows(N) if hides else -1
        views[sight.key] = View(-1, -1, program.rows(2 * N), program.rows(N), hidden)
    return Given(program, program.constant(dt), dt, q, views)


def view(
    program: Program, placed: Placed, sight: Sight, *image: int, of: int = viewing.FIRST
) -> View:
    """Return the rows of what a camera sees, with the stages that compute them (`Sight.look`)."""
    T_w_c, T_w_o = placed.frames(sight.frames)
    sight.look(program, T_w_c, T_w_o, *image, of=of)
    return View(T_w_c, T_w_o, *image[:2])
