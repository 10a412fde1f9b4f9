"""The vector field of a task: the commanded velocities at any state, and their derivatives."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, is_dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, select_runs
from robsim.base.errors import InputError, RankWarning
from robsim.features.feature import reads_pictures
from robsim.features.images.taken_pictures import TakenPictures, store_pictures
from robsim.geometry.pose import Pose, homogeneous_matrix
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.camera_target import CameraTarget, PairKey, compute_relative_pose
from robsim.servo.command import Command
from robsim.servo.goals.goal_pictures import draw_exact_pictures
from robsim.servo.laws.broyden_rule import Broyden
from robsim.servo.laws.command_quantity import require_velocity_laws
from robsim.servo.laws.depth_filter import DepthFilter
from robsim.servo.laws.feed_forward import EstimatedMotion
from robsim.servo.servo_controller import ServoController
from robsim.servo.single_step import SingleStepController
from robsim.servo.task_controller import TaskController
from robsim.servo.tasks.follow_joints import FollowJoints
from robsim.servo.tasks.follow_path import FollowPath
from robsim.servo.tasks.switch import Switch
from robsim.servo.tasks.task import Task
from robsim.world.scene import Scene

STEP = 1e-5  # step of central differences, in metres and radians
PICTURE_STEP = 0.25  # pixels of the same with pictures, which change from pixel to pixel
ROUGHNESS = 0.02  # largest ratio of second to first difference of a smooth command
PICTURE_ROUGHNESS = 0.25  # the same with pictures, which edges change abruptly

ImageArrays = dict[PairKey, Array]  # an array for each camera and target


class FieldImages(NamedTuple):
    """Images of B states.

    Attributes
    ----------
    pixels : dict of ndarray of shape (N, 2, B)
        Pixels of the marks of each camera-target pair.
    depth : dict of ndarray of shape (N, B)
        Their depths.
    pictures : dict of TakenPictures
        Pictures of the cameras of features of pictures, with grey values that are not rounded.
    """

    pixels: ImageArrays
    depth: ImageArrays
    pictures: dict[str, TakenPictures]


@dataclass(frozen=True, eq=False)
class VectorField:
    """The vector field qdot = f(q) of a task without memory, with images without borders.

    Coordinates q are (nq, B). Tangent coordinates (n, B) are commanded velocities: q is displaced
    by dq if the velocities dq are held for one second.
    """

    controller: TaskController

    @classmethod
    def of(cls, scene: Scene, task: Task, who: str = "equilibria") -> VectorField:
        """Return the field of a task.

        `who` is the subject of error messages. Raises InputError if the task has memory or the
        scene has prescribed motions.
        """
        if scene.motions:
            raise InputError(
                f"{who}: robot '{scene.motions[0].robot}' moves on its own, and a scene "
                "that changes with time has no equilibria"
            )
        for part in _list_memories(task):
            raise InputError(
                f"{who}: the command of this task depends on earlier instants "
                f"({part}), not on the state alone; leave it out"
            )
        require_velocity_laws(list(_list_laws(task)), who)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RankWarning)  # the binding of the task gives it
            if uses_pictures(task):  # a picture has a border, and marks may leave it
                return cls(task.bind(scene))
            return cls(_remove_belief_borders(task).bind(remove_image_borders(scene)))

    @property
    def scene(self) -> Scene:
        """The true scene, with images without borders."""
        scene: Scene = self.controller.scene
        return scene

    @property
    def n(self) -> int:
        """The number of commanded velocities."""
        return int(self.controller.columns.size)

    @property
    def step(self) -> float:
        """The step of central differences, in metres and radians."""
        pictured = self.controller.pictured_pairs
        focals = [
            each.eye.camera.K[0, 0] for each in self.controller.sights if each.key in pictured
        ]
        return PICTURE_STEP / float(np.max(focals)) if focals else STEP

    @property
    def roughness(self) -> float:
        """The largest ratio of second to first difference of a smooth command."""
        return PICTURE_ROUGHNESS if self.controller.pictured_pairs else ROUGHNESS

    @cached_property
    def unactuated(self) -> int:
        """The number of coordinates without a velocity: the sideways direction of each unicycle."""
        tree = self.scene.tree
        bodies = np.unique(tree.owners[self.controller.columns])
        return sum(tree.models[body].wheeled for body in bodies)

    @property
    def goal(self) -> Array | None:
        """The coordinates (nq, 1) that reach a taught goal; None if they are not known."""
        return None if self._regulated is None else self._regulated.q_goal

    @property
    def true_goal(self) -> Pose | None:
        """The true T_c_o at a goal that was taught or computed from true beliefs, else None."""
        if self.goal is not None:
            return self.pose(self.goal)[0]
        regulated = self._regulated
        if regulated is None or regulated.goal_values is not None:
            return None
        T_c_o = regulated.goal_views.compute_target_pose()
        if T_c_o is None and regulated.exact:
            T_c_o = regulated.goals[self.controller.sights[0].key].guess_last
        return None if T_c_o is None else Pose(homogeneous_matrix(T_c_o)[0])

    def pose(self, q: Array) -> Pose:
        """Return T_c_o (B) of the first target in the first camera."""
        return compute_target_pose(self.controller.sights[0], q)

    @property
    def _regulated(self) -> BoundFeatures | None:
        """The features of the first servo task; None for a user-defined kind of task."""
        part: Any = self.controller
        while hasattr(part, "parts"):
            part = part.parts[0]
        return part.bound_features if isinstance(part, ServoController) else None

    def command(self, q: Array) -> Command:
        """Return the command at states q (nq, B), each as the first instant of a run."""
        return self.respond(q, *self.images(q))[0]

    def images(self, q: Array) -> FieldImages:
        """Return the true images of all camera-target pairs at q, and exact pictures."""
        controller = self.controller
        projections = {sight.key: sight.project(q) for sight in controller.sights}
        pixels = {key: one.pixels for key, one in projections.items()}
        pictured = (each for each in controller.sights if each.key in controller.pictured_pairs)
        return FieldImages(
            pixels,
            {key: one.depth for key, one in projections.items()},
            {each.eye.name: draw_exact_pictures(each, q) for each in pictured},
        )

    def respond(
        self, q: Array, pixels: ImageArrays, depth: ImageArrays, pictures: dict[str, TakenPictures]
    ) -> tuple[Command, dict[str, Any]]:
        """Return the command for states q and images of any instant, and the law's memory."""
        blocks = self._single_step.begin(q.shape[1])
        store_pictures(blocks, pictures)
        decision = self._single_step.decide(blocks, 0, q, pixels, depth)
        return self.controller.scale_to_tolerances(decision).command, blocks.memory

    def rates(self, q: Array) -> Array:
        """Return f (n, B); NaN if a mark is behind its camera."""
        rates, is_in_front = np.full((self.n, q.shape[1]), np.nan), self.in_front(q)
        if is_in_front.any():
            with np.errstate(all="ignore"):  # invalid states give NaN
                rates[:, is_in_front] = self.command(select_runs(q, is_in_front)).qd
        return rates

    def in_front(self, q: Array) -> NDArray[np.bool_]:
        """Return whether (B,) all marks are in front of the cameras of the task."""
        depths = [sight.project(q).depth.min(axis=0) for sight in self.controller.sights]
        return np.asarray(np.min(depths, axis=0) > 0)

    def displace(self, q: Array, dq: Array) -> Array:
        """Return the states (nq, B) displaced by tangent coordinates dq (n, B)."""
        displaced = q.copy()
        velocities = np.zeros((self.scene.nv, q.shape[1]))
        velocities[self.controller.columns] = dq
        self.scene.tree.flow(displaced, velocities, 1.0)
        return displaced

    def within_limits(self, q: Array) -> Array:
        """Return the states with joints shifted by full turns into their limits, if possible."""
        limits, shifted = self.scene.limits, q.copy()
        for _, kind, rows, *_ in self.scene.tree.members:
            shifted[rows] = kind.wrap(q[rows].T, limits[rows]).T
        return shifted

    def interpolate(self, a: Array, b: Array, share: Array) -> Array:
        """Return interpolated states (nq, B) from a to b (nq, B), at shares (B,) from 0 to 1."""
        return self.scene.tree.between(a, b, share)

    def differences(self, q: Array) -> tuple[Array, Array]:
        """Return f (n, n, B) after a step forward, and after a step backward, along each velocity.

        The second index is the velocity of the step.
        """
        n, runs = self.n, q.shape[1]
        shape = n, 2, n, runs  # tangent coordinate, sign, velocity, run
        steps = np.zeros(shape)
        for j in range(n):
            steps[j, :, j] = np.array([[self.step], [-self.step]])
        wide = np.broadcast_to(q[:, None, None], (len(q), *shape[1:]))
        states = np.ascontiguousarray(wide).reshape(len(q), -1)
        ahead, behind = np.moveaxis(
            self.rates(self.displace(states, steps.reshape(n, -1))).reshape(shape), 1, 0
        )
        return ahead, behind

    def jacobian(self, q: Array) -> Array:
        """Return df/dq (n, n, B) by central differences."""
        ahead, behind = self.differences(q)
        return (ahead - behind) / (2.0 * self.step)

    def distances(self, a: Array, b: Array) -> Array:
        """Return distances (A, B) between states (nq, A) and (nq, B): the largest joint difference.

        Metres and radians count alike. Angles are compared modulo 2 pi, and floating joints by
        distance and angle. Wheel angles of vehicles do not count.
        """
        distances = np.zeros((a.shape[1], b.shape[1]))
        for _, kind, rows, _, rolls, _ in self.scene.tree.members:
            if not rolls:
                distances = np.maximum(distances, kind.distance(a[rows].T[:, None], b[rows].T))
        return distances

    @cached_property
    def _single_step(self) -> SingleStepController:
        """The controller for single steps without memory."""
        return SingleStepController(self.controller, 1.0)

    def check_memoryless(self, q: Array, who: str = "equilibria") -> None:
        """Raise InputError if a law stores values in its memory at states q."""
        with np.errstate(all="ignore"):
            _, memory = self.respond(q, *self.images(q))
        names = list(_list_stored_names(memory))
        if names:
            raise InputError(
                f"{who}: the law of this task stores {names[0]!r} between instants; its "
                "command must depend on the state alone"
            )


def compute_target_pose(sight: CameraTarget, q: Array) -> Pose:
    """Return T_c_o (B): the true poses of the target in camera axes at q (nq, B)."""
    projection = sight.project(q)
    return Pose(homogeneous_matrix(compute_relative_pose(projection.T_w_c, projection.T_w_o)))


def _list_memories(task: Any) -> Iterator[str]:
    """Yield the parts of a task, or of its inner tasks, that depend on more than the state."""
    if isinstance(task, Switch) and task.latch:
        yield "Switch with latch=True"
    if isinstance(task, FollowJoints | FollowPath):
        yield f"{type(task).__name__} follows time"
    for part in getattr(task, "inner", ()):
        yield from _list_memories(part)
    for name, kind in (
        ("interaction", Broyden),
        ("depth", DepthFilter),
        ("feed_forward", EstimatedMotion),
    ):
        if isinstance(getattr(task, name, None), kind):
            yield f"{name}={kind.__name__}(...)"
    if getattr(task, "smooth_start", None) is not None:
        yield f"smooth_start={task.smooth_start:g}"


def _list_laws(task: Any) -> Iterator[object]:
    """Yield the laws of a task and of its inner tasks."""
    if (law := getattr(task, "law", None)) is not None:
        yield law
    for part in getattr(task, "inner", ()):
        yield from _list_laws(part)


def _remove_belief_borders(task: Any) -> Any:
    """Return the task with image borders removed from its believed scene."""
    if inner := getattr(task, "inner", ()):
        return task.with_inner(list(map(_remove_belief_borders, inner)))
    belief = getattr(task, "belief", None)
    # a user-defined task may be no dataclass
    if not isinstance(belief, Scene) or not is_dataclass(task):
        return task
    return replace(cast(Any, task), belief=remove_image_borders(belief))


def uses_pictures(task: Any) -> bool:
    """Return whether a feature of a task, or of its inner tasks, uses whole pictures."""
    blocks = getattr(task, "blocks", ())
    return any(reads_pictures(block.feature) for block in blocks) or any(
        map(uses_pictures, getattr(task, "inner", ()))
    )


def remove_image_borders(scene: Scene) -> Scene:
    """Return the scene with image borders removed from its cameras."""
    eyes = (replace(eye, camera=replace(eye.camera, size=None)) for eye in scene.cameras)
    return scene.replacing(*eyes)


def _list_stored_names(memory: dict[str, Any]) -> Iterator[str]:
    """Yield the names of all values in a memory."""
    for name, value in memory.items():
        if isinstance(value, dict):
            yield from _list_stored_names(value)
        else:
            yield name
