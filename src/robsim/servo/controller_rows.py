"""Rows of a program that a controller reads, and rows that it writes."""

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
from robsim.servo.command import Command, Decision, LawInput, Signals


@dataclass(frozen=True)
class ViewRows:
    """Rows of a camera, its target, and the marks in its image."""

    pixels: BlockRows  # (N, 2)
    depth: BlockRows
    hidden: BlockRows | None = None  # (N,) 1 for a hidden mark; None if no mark can be hidden
    frames: Sequence[BlockRows] = ()  # poses of camera and target, if known


@dataclass(frozen=True)
class ControllerInputs:
    """Rows that a controller reads: measured coordinates and marks."""

    program: Program
    dt: BlockRows
    seconds: float  # value of dt
    q: BlockRows  # measured coordinates
    views: dict[PairKey, ViewRows]  # measured pixels and depths of the true scene
    placed: FKStages | None = None  # bodies of the true scene, if its q is measured exactly
    path: tuple[str, ...] = ()  # path of the task among several, for the memory of Python code
    age: BlockRows | None = None  # age of the images in periods, rounded up; None: always new
    released: BlockRows | None = None  # 1 while the robot may move; None: always

    @property
    def hides(self) -> bool:
        """Whether marks may be hidden."""
        return any(view.hidden is not None for view in self.views.values())

    def select_task(self, name: str) -> ControllerInputs:
        """Return the same rows for one of several tasks."""
        return replace(self, path=(*self.path, name))

    def memory(self, blocks: Blocks) -> dict[str, Any]:
        """Return the memory of the Python code of the task for the runs of some blocks."""
        memory = blocks.memory
        for name in self.path:
            memory = memory.setdefault(name, {})
        return memory


@dataclass(frozen=True)
class ControllerOutputs:
    """Rows that a controller writes.

    `J` returns the Jacobian of the frame from blocks, and `basis` the input of the law. `note`
    adds the stages that store the final velocities, in rows. Weights and status are None if they
    do not exist.
    """

    s: BlockRows  # (k,)
    error: BlockRows  # (k,)
    qd: BlockRows  # (n,), the commanded velocities
    task_jacobian: BlockRows  # (k, n)
    busy: BlockRows  # 1 while a run may not end as converged or stalled
    J: Callable[[Blocks], Array]
    note: Callable[[BlockRows], None] = lambda qd: None
    weights: BlockRows | None = None  # (k,), weight of each component of s
    # status of a lost mark if too few marks remain to command, or of a picture
    status: BlockRows | None = None
    basis: Callable[[Blocks], LawInput | None] = lambda blocks: None
    factors: BlockRows | None = None  # Cholesky factors of the normal equations of pictures
    step: BlockRows | None = None  # remaining step of a camera over the largest that converges
    active: BlockRows | None = None  # (c,) multiplier of each constraint of the law
    slack: BlockRows | None = None  # (c,) excess over each constraint of the law
    past: BlockRows | None = None  # (p, n) last commands that constraints use, the newest first
    gain: BlockRows | None = None  # gain of one servo task

    def decide(self, blocks: Blocks) -> Decision:
        """Return the decision from blocks, with its inputs."""
        get = blocks.get
        command = Command(*map(get, (self.s, self.error, self.qd, self.task_jacobian)))
        weights = None if self.weights is None else get(self.weights)
        return Decision(command, self.J(blocks), self.basis(blocks), weights)

    def read_signals(self, blocks: Blocks) -> Signals:
        """Return the signals of the first run."""
        weights = BlockRows(0, (0,)) if self.weights is None else self.weights
        return Signals(*map(blocks.first, (self.s, self.error, self.qd, weights)))


def allocate_inputs(
    program: Program, sights: Sequence[CameraTarget], nq: int, dt: float, hides: bool = False
) -> ControllerInputs:
    """Return input rows of coordinates and images for a controller without a simulated scene."""
    q, views = program.rows(nq), {}
    for sight in sights:
        N = len(sight.target.marks)
        hidden = program.rows(N) if hides else None
        views[sight.key] = ViewRows(program.rows(N, 2), program.rows(N), hidden)
    return ControllerInputs(program, program.constant(dt), dt, q, views)


def put_exact_images(
    blocks: Blocks, inputs: ControllerInputs, sights: Sequence[CameraTarget], q: Array
) -> None:
    """Write coordinates q (nq, B), and the exact images there, to the input rows."""
    blocks.put(inputs.q, q)
    for sight in sights:
        seen, view = sight.project(q), inputs.views[sight.key]
        blocks.put(view.pixels, seen.pixels)
        blocks.put(view.depth, seen.depth)


def add_image(
    program: Program,
    placed: FKStages,
    sight: CameraTarget,
    *image: BlockRows,
    of: int = projection.WORST_STATUS,
) -> ViewRows:
    """Add the stages that project the marks of a pair; return the rows of the image."""
    frames = placed.frames(sight.frames)
    sight.add_projection(program, *frames, *image, of=of)
    pixels, depth, _ = image
    return ViewRows(pixels, depth, frames=frames)
