"""The rows of a program that a controller is given, and those that it writes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from robsim.base.arrays import Array
from robsim.kernels.images import projection
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.robot.fk_stages import FKStages
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.servo.command import Command, Decision


@dataclass(frozen=True)
class ViewRows:
    """The rows of a camera and its target, and of the marks in its image."""

    pixels: BlockRows  # (N, 2)
    depth: BlockRows
    hidden: BlockRows | None = None  # whether each mark is hidden, where marks may be
    frames: Sequence[BlockRows] = ()  # the poses of camera and target, where these are known


@dataclass(frozen=True)
class ControllerInputs:
    """The rows that a controller is given: coordinates, and marks as measured."""

    program: Program
    dt: BlockRows
    seconds: float  # dt
    q: BlockRows  # coordinates as measured
    views: dict[PairKey, ViewRows]  # of the true scene, with pixels and depths as measured
    placed: FKStages | None = None  # the true scene, where it is as measured
    path: tuple[str, ...] = ()  # of the task among several, for what Python code remembers
    age: BlockRows | None = None  # of the images in periods, rounded up; None: they are always new
    released: BlockRows | None = None  # 1 while the robot may move; None: it always may

    @property
    def hides(self) -> bool:
        """Whether marks may be hidden."""
        return any(view.hidden is not None for view in self.views.values())

    def inside(self, name: str) -> ControllerInputs:
        """Return the same for one of several tasks."""
        return replace(self, path=(*self.path, name))

    def memory(self, blocks: Blocks) -> dict[str, Any]:
        """Return what Python code of the task remembers of the runs of some blocks."""
        memory = blocks.memory
        for name in self.path:
            memory = memory.setdefault(name, {})
        return memory


@dataclass(frozen=True)
class ControllerOutputs:
    """The rows that a controller writes.

    `J` returns from blocks the Jacobian of its frame, `basis` what a law was given; `note` adds the
    stages that remember the velocities, in rows, that were commanded in the end. What there is
    not is None: weights, and the status of images whose marks need not all be seen.
    """

    s: BlockRows  # (k,)
    error: BlockRows  # (k,)
    qd: BlockRows  # (n,), the commanded velocities
    task_jacobian: BlockRows  # (k, n)
    busy: BlockRows  # 1 where a run may not end because it has converged or stalls
    J: Callable[[Blocks], Array]
    note: Callable[[BlockRows], None] = lambda qd: None
    weights: BlockRows | None = None  # (k,), how much each number of s counts
    status: BlockRows | None = (
        None  # that of a mark out of the image, where too few are left to command
    )
    basis: Callable[[Blocks], Any] = lambda blocks: None

    def decide(self, blocks: Blocks) -> Decision:
        """Return from blocks what was decided, with all that it is based on."""
        get = blocks.get
        command = Command(*map(get, (self.s, self.error, self.qd, self.task_jacobian)))
        weights = None if self.weights is None else get(self.weights)
        return Decision(command, self.J(blocks), self.basis(blocks), weights)


def allocate_inputs(
    program: Program, sights: Sequence[CameraTarget], nq: int, dt: float, hides: bool = False
) -> ControllerInputs:
    """Return the rows of coordinates and of what cameras see, which are written by hand."""
    q, views = program.rows(nq), {}
    for sight in sights:
        N = len(sight.target.marks)
        hidden = program.rows(N) if hides else None
        views[sight.key] = ViewRows(program.rows(N, 2), program.rows(N), hidden)
    return ControllerInputs(program, program.constant(dt), dt, q, views)


def add_image(
    program: Program,
    placed: FKStages,
    sight: CameraTarget,
    *image: BlockRows,
    of: int = projection.WORST_STATUS,
) -> ViewRows:
    """Return the rows of what a camera sees, with the stages that compute them (`CameraTarget.look`)."""
    frames = placed.frames(sight.frames)
    sight.look(program, *frames, *image, of=of)
    pixels, depth, _ = image
    return ViewRows(pixels, depth, frames=frames)
