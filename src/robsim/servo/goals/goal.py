"""Goals of a task: shown to the true camera, computed from a pose, or given as numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, make_read_only, move_runs_last
from robsim.base.errors import GoalError, InputError
from robsim.base.parameter_names import name_parameters
from robsim.base.value import Value
from robsim.declare import ListOf
from robsim.declare.array_types import Numbers
from robsim.declare.context import MISSING, Context, NoTextError, Raw
from robsim.declare.joint_numbers import PerJoint, get_coordinate_axes
from robsim.declare.problems import prefix_path
from robsim.declare.tables import Table, write_table
from robsim.features.feature import Observation
from robsim.geometry.grey_picture import GreyPicture, PictureLike
from robsim.geometry.picture_spec import PICTURE, open_picture
from robsim.geometry.pose import Pose, PoseLike, check_single_pose, homogeneous_matrix
from robsim.geometry.pose_table import FLAT_POSE, POSE, propose_short_poses
from robsim.robot.joints.floating_joint import FloatingJoint
from robsim.robot.robot_table import MOST_LISTED_PARTS
from robsim.servo.camera_target import CameraTarget, compute_relative_pose
from robsim.servo.goals.body_place import (
    BodyPlace,
    Places,
    check_places,
    find_believed_places,
    make_places,
    place_bodies,
)
from robsim.vision.camera import Visibility
from robsim.world.scene import Scene

FLOATING_UNITS = FloatingJoint.units


Configuration = ArrayLike | Mapping[str, ArrayLike]  # (nq,), or {robot: its coordinates}


def _copy_configuration(q: Any) -> Any:
    """Return a read-only copy of q; the task checks its size in the scene."""
    if isinstance(q, Mapping):
        return {name: _copy_configuration(value) for name, value in q.items()}
    if isinstance(q, np.ndarray | list | tuple):
        try:
            return make_read_only(as_floats(q, "goal q", ("nq",)))
        except InputError as error:
            raise GoalError(str(error)) from None
    return q


@name_parameters
@dataclass(frozen=True, eq=False)
class TaughtGoal(Value):
    """Goal shown to the true camera: the features it measures at a configuration of the robot.

    This is teaching by showing. The goal is reachable, and it is measured like the images of the
    run, so wrong intrinsics or a wrong hand-eye pose leave no final error. A task accepts the
    configuration itself as its goal.

    If objects or cameras have moved since the goal was shown, `places` keeps their places of that
    time: the goal remains the image that was shown, and the robot follows the target to its new
    place. Without `places` the goal is shown in the scene as it is.

    Parameters
    ----------
    q : array_like of shape (nq,) or dict of robot names to arrays, optional
        Configuration of the shown goal, as in `simulate`. Default: the home configuration.
    places : dict of names to pose_like, optional
        Poses of objects and cameras when the goal was shown, each in the frame that carries the
        body, as `Object.pose`. A body without an entry has its pose of the scene. The belief of a
        task keeps its error: a body at T_true with the believed pose T_true E was then believed to
        be at place E. Stored as a tuple of places, each with `name` and `pose`.
    picture : str, path, array_like of uint8 of shape (h, w), or GreyPicture, optional
        Photograph of the camera at the goal, for features of pictures. Default: the picture that
        the true camera of the scene takes at q.

    Raises
    ------
    GoalError
        If q is not an array of finite numbers, or a place is not a pose; by `simulate`, if a mark
        is outside the image at q, if the scene lacks a body of `places`, or if the picture does not
        have the size of the camera.
    InputError
        If `picture` is not a picture, or its file cannot be read.

    Examples
    --------
    >>> TaughtGoal([0.1, 0.2]).q
    array([0.1, 0.2])
    >>> from robsim import IBVS
    >>> IBVS([0.1, 0.2]).goal == TaughtGoal([0.1, 0.2])
    True

    The camera follows a plate that was pulled 6 cm after its image was shown:

    >>> import robsim as rs
    >>> one = rs.load_scenario(rs.examples.path("eye_in_hand"))
    >>> goal = TaughtGoal(one.task.goal.q, places={"plate": one.scene.object("plate").pose})
    >>> pulled = one.at({"task.goal": goal, "objects.plate.position": "37, 0, 10 cm"})
    >>> f"{1000 * float(pulled.run().distance_to_goal):.1f} mm"
    '0.0 mm'
    """

    q: Configuration | None = None
    places: Mapping[str, PoseLike] | Places = ()
    picture: PictureLike | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "q", _copy_configuration(self.q))
        if self.picture is not None:
            object.__setattr__(self, "picture", open_picture(self.picture))
        object.__setattr__(self, "places", make_places(self.places))


@name_parameters
@dataclass(frozen=True)
class GoalPose:
    """Goal computed from a pose: the features that the controller expects at this pose.

    The features follow from the believed camera and target. Errors of the calibration therefore
    enter the final pose, and the pose may be unreachable. Use it to place the camera relative to
    the target without a view of the goal.

    Parameters
    ----------
    T_c_o : Pose or array_like of shape (4, 4)
        Pose of the target in camera axes at the goal.

    Raises
    ------
    InputError
        If `T_c_o` is not one pose.
    GoalError
        By `simulate`, if a mark is outside the image at this pose.

    Examples
    --------
    >>> GoalPose(Pose.at(0, 0, 0.5)).T_c_o.position
    array([0. , 0. , 0.5])
    """

    T_c_o: Pose

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_c_o", check_single_pose(self.T_c_o, "goal T_c_o"))


@name_parameters
@dataclass(frozen=True, eq=False)
class GoalFeatures(Value):
    """Goal given as numbers: the desired features s, without an image.

    No camera has measured these values, so they may be unreachable, and options that need a view of
    the goal are not available (interaction "desired" and "mean", depth "goal"). Robust weightings
    need the features "points" or "pixels" of every mark. Use it for a point in the image, such as
    its centre.

    Parameters
    ----------
    s : array_like of shape (k,)
        Desired features, in the units and order of the task's features.

    Raises
    ------
    GoalError
        If s is not one array of finite numbers; by `simulate`, if its length is not k.

    Examples
    --------
    >>> GoalFeatures([0.1, 0.2]).s
    array([0.1, 0.2])
    """

    s: ArrayLike

    def __post_init__(self) -> None:
        s = as_floats(self.s, "goal s", ("k",))
        if s.ndim != 1 or not s.size:
            raise GoalError(f"goal s: expected shape (k,), got {s.shape}")
        object.__setattr__(self, "s", make_read_only(s))


GoalKind = TaughtGoal | GoalPose | GoalFeatures
Goal = GoalKind | Configuration  # a goal, or the configuration of a shown goal


@dataclass(frozen=True)
class GoalTable:
    """Table of a goal in a text: a configuration, a pose, or numbers."""

    rivals: ClassVar[Any] = (
        (("q",), ("pose",), ("computed",), ("s",)),
        (("places",), ("computed",), ("s",)),
        (("picture",), ("computed",), ("s",)),
    )

    q: Annotated[
        ArrayLike | None,
        PerJoint(get_coordinate_axes),
        "Configuration at which the goal is shown, one number for each coordinate.",
    ] = None
    pose: Annotated[Pose | None, FLAT_POSE, "Pose of a free camera at which the goal is shown."] = (
        None
    )
    computed: Annotated[
        Pose | None,
        POSE,
        "Pose of the target in camera axes, T_c_o, from which the goal is computed.",
    ] = None
    s: Annotated[ArrayLike | None, Numbers(), "Features at the goal, as numbers."] = None
    places: Annotated[
        Places,
        ListOf(Table(BodyPlace), most=MOST_LISTED_PARTS),
        "Objects and cameras that have moved since the goal was shown, at their places of then.",
    ] = ()
    picture: Annotated[
        GreyPicture | None,
        PICTURE,
        "Photograph of the camera at the goal, for features of pictures; None: the picture of the "
        "scene.",
    ] = None

    def build_value(self, c: Context) -> GoalKind:
        """Return the goal."""
        if self.s is not None:
            return GoalFeatures(self.s)
        if self.computed is not None:
            return GoalPose(self.computed)
        scene = c.facts.get("scene")
        if scene is not None:
            with prefix_path("places"):
                check_places(self.places, scene)
        q = parse_start(self.q, self.pose, scene, "goal q")
        return TaughtGoal(q, self.places, self.picture)

    @classmethod
    def of(cls, value: GoalKind, c: Context) -> GoalTable:
        """Return the table of a goal."""
        if isinstance(value, GoalPose):
            return cls(computed=value.T_c_o)
        if isinstance(value, GoalFeatures):
            return cls(s=value.s)
        scene, places = c.facts["scene"], cast(Places, value.places)
        more: Any = {"places": places, "picture": value.picture}
        if c.facts.get("by_hand"):
            return cls(*describe_start(value.q, scene), **more)
        if c.facts.get("short") and value.q is not None:
            return cls(*describe_start_exactly(value.q, scene), **more)
        q = None if value.q is None else scene.coordinates(value.q, limits=False)
        return cls(q, **more)


@dataclass(frozen=True)
class GoalSpec(Table):
    """A goal; in Python also the configuration q of a shown goal."""

    kind: Any = GoalKind
    says: type[Any] | None = GoalTable
    takes_none: ClassVar[bool] = True  # None is the home configuration
    phrase: ClassVar[str] = "a goal: q, a pose, computed or s"
    python_phrase: ClassVar[str] = "q (nq,), {robot: q}, a TaughtGoal, a GoalPose or GoalFeatures"

    def check(self, value: Any, what: str) -> GoalKind:
        return value if isinstance(value, GoalKind) else TaughtGoal(value)

    def build_table(self, value: Any, c: Context, key: str | None = None) -> dict[str, Raw]:
        if type(value) not in (TaughtGoal, GoalPose, GoalFeatures):
            raise NoTextError(f"{type(value).__name__} is Python code")
        return write_table(value, c.with_old_value(MISSING), GoalTable)

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        if raw := self.write(value, c.at(name)):
            table[name] = raw


def parse_start(q: Any, pose: Pose | None, scene: Any, what: str) -> Any:
    """Return coordinates of the robots from a text, or None (home) if the text gives none."""
    if scene is None or (q is None and pose is None):
        return None
    if pose is None:
        with prefix_path("q"):
            return scene.coordinates(q, what)
    if scene.coordinate_units != FLOATING_UNITS:
        names = ", ".join(scene.coordinate_names) or "no coordinates"
        raise InputError(f"a pose is for a scene whose only joint floats; give q, of {names}")
    return scene.coordinates(pose.q, what)


def describe_start(q: Any, scene: Scene) -> tuple[Array | None, Pose | None]:
    """Return the coordinates of a start; for one floating joint, its pose instead."""
    at, pose = describe_start_exactly(scene.home if q is None else q, scene)
    if at is None or scene.coordinate_units != FLOATING_UNITS:
        return at, pose
    return None, Pose.from_quaternion(at[:3], at[3:])


def describe_start_exactly(q: Any, scene: Scene) -> tuple[Array | None, Pose | None]:
    """Return the coordinates of a start, or a pose of short angles with exactly these coordinates.

    >>> from robsim import robots
    >>> q = Pose.at(0, 0, -1, rotvec=(0.0, 0.0, 0.5)).q
    >>> describe_start_exactly(q, Scene([robots.free_camera()]))[1].rotvec
    array([0. , 0. , 0.5])
    """
    at = np.asarray(scene.coordinates(q, limits=False))
    if scene.coordinate_units == FLOATING_UNITS and at.ndim == 1:
        near = Pose.from_quaternion(at[:3], at[3:])
        for _, _, pose in propose_short_poses(near):
            if scene.coordinates(pose.q, limits=False).tobytes() == at.tobytes():
                return None, pose
    return at, None


def find_goal_configuration(goal: GoalKind, scene: Scene, runs: int) -> Array | None:
    """Return the coordinates (nq, runs) of a shown goal, or None for other goals."""
    if not isinstance(goal, TaughtGoal):
        return None
    try:
        q = scene.coordinates(scene.home if goal.q is None else goal.q, "goal q")
    except InputError as error:
        raise GoalError(str(error)) from None
    if q.ndim != 1:
        raise GoalError(f"a goal is shown at one q of shape ({scene.nq},), got {q.shape}")
    return np.repeat(q[:, None], runs, axis=1)


Pairs = tuple[CameraTarget, ...]


def find_goal_pairs(goal: GoalKind, truths: Pairs, beliefs: Pairs) -> tuple[Pairs, Pairs]:
    """Return the true and the believed pairs in the scenes in which a goal is shown.

    They differ from the present pairs if the goal has `places`. Raises GoalError if the scene lacks
    a body of the places.
    """
    if not isinstance(goal, TaughtGoal) or not goal.places:
        return truths, beliefs
    places = cast(Places, goal.places)
    scene, belief = truths[0].scene, beliefs[0].scene
    check_places(places, scene)
    shown = place_bodies(scene, {each.name: each.pose for each in places})
    if belief is scene:
        believed = shown
    else:
        believed = place_bodies(belief, find_believed_places(places, scene, belief))
    moved_truths = tuple(each.in_scene(shown) for each in truths)
    if beliefs is truths:
        return moved_truths, moved_truths
    return moved_truths, tuple(each.in_scene(believed) for each in beliefs)


def observe_goal(
    goal: GoalKind,
    q: Array | None,
    truth: CameraTarget,
    belief: CameraTarget,
    first: CameraTarget,
    runs: int,
    needs_marks: bool = True,
) -> Observation:
    """Return the observation of the goal by a camera, with true depths.

    q (nq, runs) is the result of `find_goal_configuration`; `runs` exceeds 1 if numbers of the
    scene differ from run to run. A computed goal is the pose of the believed target of `first` in
    its camera; the other camera-target pairs follow if they move with `first`. A goal of numbers
    has no image: its observation, at home, only has the right shape. Raises GoalError if a mark is
    outside the image, unless no feature of the pair needs marks.
    """
    if isinstance(goal, GoalPose):
        return _observe_computed_goal(goal, belief, first, runs, needs_marks)
    q_shown = truth.home(runs) if q is None else q  # for numbers, only the shape matters
    projection = truth.project(q_shown)
    believed = projection if belief is truth else belief.project(q_shown)
    if q is not None and needs_marks:
        _check_marks_visible(truth, projection.visibility, "shown")
    T_c_o = compute_relative_pose(believed.T_w_c, believed.T_w_o)
    return belief.observation(projection.pixels, projection.depth, T_c_o)


def _observe_computed_goal(
    goal: GoalPose, belief: CameraTarget, first: CameraTarget, runs: int, needs_marks: bool
) -> Observation:
    """Return the observation of a computed goal; raise GoalError if it is impossible."""
    if not belief.moves_with(first):
        raise GoalError(
            f"camera '{belief.eye.name}' and '{belief.target.name}' do not move as "
            f"'{first.eye.name}' and '{first.target.name}' do, for which the goal is computed: "
            "show the goal at a q instead"
        )
    T_c_o = np.repeat(goal.T_c_o.matrix[:3, :, None], runs, axis=2)
    if belief is not first:
        own, reference = (s.project(s.home(runs)) for s in (belief, first))
        T_c_f, T_f_o = (
            compute_relative_pose(own.T_w_c, reference.T_w_c),
            compute_relative_pose(reference.T_w_o, own.T_w_o),
        )
        T_c_o = move_runs_last(
            (_make_poses(T_c_f) @ goal.T_c_o @ _make_poses(T_f_o)).matrix[:, :3], 2
        )
    depth, pixels, status = belief.image(np.eye(3, 4)[..., None], T_c_o)
    if needs_marks:
        _check_marks_visible(belief, status, "computed")
    return belief.observation(pixels, depth, T_c_o)


def _make_poses(T: Array) -> Pose:
    """Return poses from T (3, 4, B)."""
    return Pose(homogeneous_matrix(T))


def _check_marks_visible(sight: CameraTarget, status: Any, kind: str) -> None:
    """Raise GoalError for the first mark that is outside the image, (N, B), in any run."""
    for run, n in np.argwhere(status.T != Visibility.IN_IMAGE)[:1]:
        place = "behind" if status[n, run] == Visibility.BEHIND_CAMERA else "out of the image of"
        suffix = f" of run {run}" if status.shape[1] > 1 else ""
        raise GoalError(
            f"the {kind} goal{suffix} puts mark {n} of '{sight.target.name}' {place} "
            f"camera '{sight.eye.name}'"
        )
