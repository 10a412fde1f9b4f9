"""What every task can be told, and how it is bound to a scene."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, Protocol, get_args, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.arrays import Array, frozen, numbers, positive
from robsim.errors import InputError, RankWarning, suggest
from robsim.features import Points
from robsim.kernels.tree import UNICYCLE
from robsim.scene import Scene
from robsim.servo.broyden import Broyden
from robsim.servo.controller import Controller, Servo, pace, rank_at_goal, rcond_of
from robsim.servo.depths import Depth, Depths, as_depth
from robsim.servo.feed_forward import as_feed_forward
from robsim.servo.gain import Adaptive, as_gain
from robsim.servo.goal import Given, as_goal, configuration, view_of
from robsim.servo.inverse import as_inverse, rank
from robsim.servo.law import as_law
from robsim.servo.limit import SpeedLimit
from robsim.servo.part import Part, as_cameras, as_parts
from robsim.servo.redundancy import Secondary
from robsim.servo.regulated import Bound, Interaction, Regulated, goal_looks, goal_seen
from robsim.servo.shaping import Shaping, as_projection, coordinates_of
from robsim.servo.sight import Sight, sight
from robsim.value import Value

Columns = NDArray[np.int64]


@runtime_checkable
class Task(Protocol):
    """What can be simulated in a scene."""

    def columns(self, scene: Scene) -> Columns:
        """The velocities that the task commands."""

    def bind(self, scene: Scene, columns: Columns | None = None) -> Controller:
        """Its controller; InputError or GoalError if it makes no sense there.

        `columns` are the velocities that are commanded where several tasks share them.
        """


@dataclass(frozen=True, eq=False)
class Shaped(Value):
    """What can be done to a command after the law.

    joints        names of robots or velocities that are commanded; None: all that matter
    secondary     a motion within what the task leaves free: `AvoidLimits()`, `Posture(q)`, or any
                  object with velocity(q, limits)
    projection    of the secondary motion: "classic", "large" or `Large(low, high)`
    smooth_start  per second: the command grows from zero, with exp(-smooth_start t)
    limit         `SpeedLimit(...)`
    """

    _: KW_ONLY
    joints: Any = None
    secondary: Any = None
    projection: Any = "classic"
    smooth_start: float | None = None
    limit: SpeedLimit | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "joints", _names(self.joints))
        if self.secondary is not None and not isinstance(self.secondary, Secondary):
            raise InputError(
                f"secondary: expected AvoidLimits(), Posture(q) or an object with "
                f"velocity(q, limits), got {self.secondary!r:.80}"
            )
        as_projection(self.projection)
        if self.smooth_start is not None:
            put(self, "smooth_start", positive(self.smooth_start, "smooth_start (per second)"))
        if self.limit is not None and not isinstance(self.limit, SpeedLimit):
            raise InputError(f"limit: expected SpeedLimit(...), got {self.limit!r:.80}")

    def shaping(self, scene: Scene, columns: Columns) -> Shaping:
        """For the commanded velocities of a scene."""
        names = [scene.velocity_names[i] for i in columns]
        parts: tuple[Any, ...] = (self.limit, self.secondary)
        for part in parts:
            if hasattr(part, "check"):
                part.check(names)
        return Shaping(
            self.secondary,
            as_projection(self.projection),
            self.smooth_start,
            self.limit,
            *coordinates_of(scene, columns),
        )

    def chosen(self, scene: Scene, moving: Columns) -> Columns:
        """Those of the velocities that `joints` names."""
        if self.joints is None:
            return moving
        wanted: set[int] = set()
        for name in self.joints:
            wanted |= set(_velocities(scene, name))
        chosen = np.array([i for i in moving if i in wanted], dtype=np.int64)
        if not chosen.size:
            names = [scene.velocity_names[i] for i in moving]
            raise InputError(
                f"joints: none of {', '.join(self.joints)} moves what the task looks at; "
                f"these do: {', '.join(names)}"
            )
        return frozen(chosen)


@dataclass(frozen=True, eq=False)
class ServoTask(Shaped):
    """Drive e = s - s_goal to zero: what IBVS, PBVS and their kin have in common."""

    goal: Any = None
    camera: Any = None
    target: str | None = None
    features: Any = field(default_factory=Points)
    interaction: Any = "current"
    depth: Depth = "true"
    depth_scale: float = 1.0
    law: Any = "joint"
    gain: float | Adaptive = 1.0
    inverse: Any = "truncated"
    tolerance: float | None = None
    belief: Scene | None = None
    _: KW_ONLY
    feed_forward: Any = None

    def __post_init__(self) -> None:
        super().__post_init__()
        put = object.__setattr__
        put(self, "goal", as_goal(self.goal))
        put(self, "camera", as_cameras(self.camera))
        parts = as_parts(self.features)
        bare = len(parts) == 1 and not isinstance(self.features, Part | list | tuple)
        put(self, "features", parts[0].feature if bare else parts)
        put(self, "law", as_law(self.law))
        put(self, "inverse", as_inverse(self.inverse))
        put(self, "gain", as_gain(self.gain))
        put(self, "depth_scale", positive(self.depth_scale, "depth_scale"))
        put(self, "depth", as_depth(self.depth))
        put(self, "interaction", _as_interaction(self.interaction))
        put(self, "feed_forward", as_feed_forward(self.feed_forward))
        if self.tolerance is not None:
            put(self, "tolerance", positive(self.tolerance, "tolerance"))

    @property
    def parts(self) -> tuple[Part, ...]:
        """All features with who sees them."""
        return as_parts(self.features)

    def columns(self, scene: Scene) -> Columns:
        """The velocities that move a camera of the task against its target."""
        found = [s.columns for each in self._sights(scene) for s in each]
        return self.chosen(scene, frozen(np.unique(np.concatenate(found))))

    def bind(self, scene: Scene, columns: Columns | None = None) -> Servo:
        """The controller of this task in a scene; every name and the goal are checked here.

        RankWarning: the features do not fix every motion that the joints can make.
        """
        shared = columns is not None
        columns = self.columns(scene) if columns is None else columns
        regulated, truths = self._regulated(scene, columns)
        self._check_sense(regulated)
        s_goal = regulated.s_goal
        own = regulated.tolerances
        controller = Servo(
            truths,
            columns,
            s_goal,
            regulated.units,
            own if self.tolerance is None else np.full(own.shape, self.tolerance),
            regulated.goal_pixels,
            pace(regulated, self.gain, self.inverse),
            rank_at_goal(regulated),
            rcond_of(self.inverse),
            regulated,
            self.bound_law(regulated),
            self.gain,
            self.inverse,
            self.feed_forward,
            self.interaction if isinstance(self.interaction, Broyden) else None,
            self.shaping(scene, columns),
        )
        if not shared and self.secondary is None:
            _warn_of_rank(controller)
            self.warn_of_wheels(controller)
        return controller

    def warn_of_wheels(self, controller: Servo) -> None:
        """RankWarning if a unicycle alone is asked for more than two numbers."""
        tree, columns = controller.scene.tree, controller.columns
        rolls = (tree.joints.kind[tree.body[columns]] == UNICYCLE).all()
        if rolls and controller.k > columns.size:
            warnings.warn(
                "a unicycle cannot move sideways, and no smooth law drives it to a pose (Brockett "
                "1983): use Docking, or no more features than it has velocities",
                RankWarning,
                stacklevel=4,
            )

    def bound_law(self, regulated: Regulated) -> Any:
        """The law, which may need to know the scene."""
        return self.law

    def _sights(self, scene: Scene) -> list[tuple[Sight, ...]]:
        """Of each part, the sights of its one or two cameras."""
        made: dict[tuple[str, str], Sight] = {}
        each = []
        for part in self.parts:
            target = part.target or self.target
            names = part.camera or self.camera
            several = names if isinstance(names, tuple) else (names,)
            found = [sight(scene, name, target) for name in several]
            each.append(tuple(made.setdefault(s.key, s) for s in found))
        return each

    def _regulated(self, scene: Scene, columns: Columns) -> tuple[Regulated, tuple[Sight, ...]]:
        """What is regulated, and the true sights."""
        truth = self._sights(scene)
        belief, exact = truth, self.belief is None or self.belief == scene
        if not exact:
            belief = _believed(self, scene, truth)
        truths, sights = _each_once(truth), _each_once(belief)
        depths = Depths(self.depth, self.depth_scale)
        given = self.goal.s if isinstance(self.goal, Given) else None
        goals = {
            t.key: view_of(self.goal, t, b, sights[0]) for t, b in zip(truths, sights, strict=True)
        }
        q_goal = None if given is not None else configuration(self.goal, scene)
        bound = [
            _bound(part, found, len(found[0].target.marks), depths)
            for part, found in zip(self.parts, belief, strict=True)
        ]
        seen, looks = goal_seen(sights, goals, depths), goal_looks(sights, q_goal)
        views = [part.observation(seen, looks) for part in bound]
        if given is None:
            bound = [part.towards(view) for part, view in zip(bound, views, strict=True)]
        bound = [part.counted(view) for part, view in zip(bound, views, strict=True)]
        which: Any = "current" if isinstance(self.interaction, Broyden) else self.interaction
        regulated = Regulated(
            tuple(bound), sights, exact, columns, depths, which, goals, q_goal, given
        )
        return regulated, truths

    def _check_sense(self, regulated: Regulated) -> None:
        """InputError for what contradicts itself in this scene."""
        law, k, n = type(self.law).__name__, regulated.k, regulated.columns.size
        in_camera = bool(getattr(self.law, "in_camera", False))
        if in_camera and not regulated.as_one:
            raise InputError(
                f"{law} commands the twist of one camera, and the cameras of this task do not move "
                "as one against their targets: use law='joint'"
            )
        if isinstance(self.interaction, Broyden):
            if in_camera:
                raise InputError(
                    f"Broyden's rule learns how the joints move the features, and {law} asks how "
                    "the camera does: use law='joint'"
                )
            start = self.interaction.start
            if start is not None and start.shape != (k, n):
                raise InputError(
                    f"Broyden start: expected shape ({k}, {n}), {k} features by {n} commanded "
                    f"velocities, got {start.shape}"
                )
        if isinstance(self.interaction, np.ndarray):
            if not regulated.as_one:
                raise InputError(
                    "a constant interaction matrix is for cameras that move as one; these do not"
                )
            if self.interaction.shape != (k, 6):
                raise InputError(
                    f"interaction: expected shape ({k}, 6), a row for each of the {k} features, "
                    f"got {self.interaction.shape}"
                )
        if isinstance(self.goal, Given) and (
            self.depth == "goal"
            or (isinstance(self.interaction, str) and self.interaction != "current")
        ):
            raise InputError(
                "a goal given as numbers has no image: L desired or mean and depth='goal' need a "
                "goal that is shown or computed"
            )


def _names(given: Any) -> tuple[str, ...] | None:
    if given is None:
        return None
    names = (
        (given,)
        if isinstance(given, str)
        else tuple(given)
        if isinstance(given, list | tuple)
        else ()
    )
    if not names or not all(isinstance(name, str) for name in names):
        raise InputError(f"joints: expected names of robots or velocities, got {given!r:.80}")
    return names


def _velocities(scene: Scene, name: str) -> Sequence[int]:
    """Indices of a robot's velocities, or of the velocity of that name."""
    names = scene.velocity_names
    starts = np.cumsum([0, *(robot.nv for robot in scene.robots)])
    for i, robot in enumerate(scene.robots):
        if robot.name == name:
            found: Sequence[int] = range(int(starts[i]), int(starts[i + 1]))
            break
    else:
        if name not in names:
            exists = [*(robot.name for robot in scene.robots), *names]
            raise InputError(
                f"joints: no robot or velocity {name!r}; {suggest(name, exists, 'names')}"
            )
        found = [names.index(name)]
    if scene.prescribed[list(found)].any():
        raise InputError(f"joints: '{name}' moves on its own; a task cannot command it as well")
    return found


def _as_interaction(given: Any) -> Interaction | Broyden | Array:
    if isinstance(given, Broyden):
        return given
    kinds = get_args(Interaction)
    if isinstance(given, str):
        if given == "broyden":
            return Broyden()
        if given not in kinds:
            raise InputError(
                f"no interaction matrix {given!r}; "
                f"{suggest(given, [*kinds, 'broyden'], 'choices')}, or a constant (k, 6)"
            )
        return given  # type: ignore[return-value]
    if not np.ndim(given) or np.asarray(given).dtype.kind not in "iuf":
        raise InputError(
            f"no interaction matrix {given!r:.80}; {suggest(given, [*kinds, 'broyden'], 'choices')}"
        )
    L = numbers(given, "interaction", ("k", 6))
    if L.ndim != 2:
        raise InputError(f"interaction: expected one matrix of shape (k, 6), got {L.shape}")
    return frozen(L)


def _each_once(sights: list[tuple[Sight, ...]]) -> tuple[Sight, ...]:
    return tuple({s.key: s for found in sights for s in found}.values())


def _bound(part: Part, sights: tuple[Sight, ...], marks: int, depths: Depths) -> Bound:
    """A part with its sights; InputError if the marks or cameras are too few for its feature."""
    feature, name = part.feature, type(part.feature).__name__
    cameras, there = getattr(feature, "cameras", 1), "', '".join(s.eye.name for s in sights)
    if cameras != len(sights):
        raise InputError(
            f"{name} needs {'two cameras' if cameras == 2 else 'one camera'}, and is given "
            f"'{there}'" + ("; as in camera=('left', 'right')" if cameras == 2 else "")
        )
    chosen = None if part.marks is None else np.array(part.marks, dtype=np.int64)
    target = sights[0].target
    if chosen is not None and chosen.max() >= marks:
        raise InputError(
            f"'{target.name}' has {marks} marks, numbered from 0; there is no {chosen.max()}"
        )
    used = target.marks if chosen is None else target.marks[chosen]
    least = max(
        getattr(feature, "least_marks", 1), 3 if getattr(feature, "uses_pose", False) else 1
    )
    if len(used) < least:
        raise InputError(f"{name} needs at least {least} marks, and sees {len(used)}")
    if getattr(feature, "uses_pose", False) and collinear(used):
        raise InputError(
            f"{name} needs marks that are not on one line: a pose follows from no line"
        )
    if getattr(feature, "measures_depth", False) and not depths.measured:
        raise InputError(
            f"{name} is made of the depth of the marks, and depth={depths.which!r} gives none: "
            "use depth='true' or a DepthFilter"
        )
    components = None if part.components is None else np.array(part.components, dtype=np.int64)
    return Bound(feature, sights, chosen, components, part.weight)


def _believed(
    task: ServoTask, scene: Scene, truth: list[tuple[Sight, ...]]
) -> list[tuple[Sight, ...]]:
    """A belief may differ in every number, but not in what there is."""
    belief = task.belief
    if not isinstance(belief, Scene):
        raise InputError(f"belief must be a Scene (see Scene.replacing), got {belief!r:.80}")
    there, here = _joints(belief), _joints(scene)
    if there != here:
        raise InputError(f"the belief has the joints {there}, the scene {here}")
    try:
        made = {
            s.key: Sight(belief, belief.camera(s.key[0]), belief.object(s.key[1]))
            for found in truth
            for s in found
        }
    except InputError as error:
        raise InputError(f"belief: {error}") from None
    for found in truth:
        for s in found:
            marks = len(made[s.key].target.marks)
            if marks != len(s.target.marks):
                raise InputError(
                    f"the belief has {marks} marks on '{s.target.name}', "
                    f"the scene {len(s.target.marks)}"
                )
    return [tuple(made[s.key] for s in found) for found in truth]


def _joints(scene: Scene) -> list[str]:
    """Coordinates with their units: two joints of one name may be of different kinds."""
    both = zip(scene.coordinate_names, scene.coordinate_units, strict=True)
    return [f"{name} ({unit})" for name, unit in both]


def _warn_of_rank(controller: Servo) -> None:
    regulated, first = controller.regulated, controller.sights[0]
    full = min(6 * regulated.motions, controller.columns.size)
    found = controller.full_rank
    if regulated.q_goal is None and regulated.given is None and regulated.as_one:
        found = min(found, int(rank(regulated.at_goal.L)[0]))  # there is no Jacobian at the goal
    if found < full:
        marks = np.unique(first.target.marks, axis=0)
        cause = "its marks lie on one line; " if collinear(marks) else ""
        warnings.warn(
            f"the features of '{first.target.name}' fix only {found} of the {full} "
            f"motions of camera '{first.eye.name}' at the goal: {cause}"
            "use at least three marks that are not on one line",
            RankWarning,
            stacklevel=4,
        )


def collinear(marks: Any) -> bool:
    """Whether marks (N, 3) lie on one line."""
    return int(np.linalg.matrix_rank(marks - marks[:1], tol=1e-9)) < 2
