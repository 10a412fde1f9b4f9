"""The protocol of tasks, and the fields and binding of every servo task."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import Annotated, Any, ClassVar, Protocol, cast, runtime_checkable

import numpy as np

from robsim.base.arrays import make_read_only, move_runs_last
from robsim.base.errors import CodeError
from robsim.declare import Number, described
from robsim.declare.context import Context, Raw
from robsim.features.interaction_matrix import InteractionMatrix
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.camera_target import CameraTarget
from robsim.servo.controller_matrices import compute_controller_matrices
from robsim.servo.feature_block import (
    CAMERAS,
    TARGET,
    FeatureBlock,
    Features,
    Name,
    make_feature_blocks,
)
from robsim.servo.goals.goal import Configuration, Goal, GoalKind, GoalSpec
from robsim.servo.laws.broyden_rule import Broyden
from robsim.servo.laws.depth_model import DepthModel
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.laws.inverse import PseudoInverse
from robsim.servo.laws.law import JointLaw, Law, LawLike
from robsim.servo.servo_controller import (
    ServoController,
    compute_decay_rate,
    compute_goal_rank,
    get_rcond,
)
from robsim.servo.shaping.command_fields import CommandFields, VelocityIndices
from robsim.servo.task_controller import LAST_STEPS, TaskController
from robsim.servo.tasks.belief_spec import BeliefSpec
from robsim.servo.tasks.feature_binder import (
    BlockTargets,
    bind_features,
    deduplicate_targets,
    find_camera_targets,
)
from robsim.servo.tasks.kept_controller import OTHER_FIELDS, get_kept_controller, keep_controller
from robsim.servo.tasks.task_checks import (
    check_bound_law,
    check_feature_tolerance,
    check_goal_interaction,
    check_servo_fields,
    warn_of_rank,
    warn_of_wheels,
)
from robsim.servo.weightings.mark_dependencies import check_weighting
from robsim.vision.detectors.mark_detector import DETECTOR, MarkDetector
from robsim.world.scene import Scene


@runtime_checkable
class Task(Protocol):
    """Protocol of a task: an object that can be simulated in a scene."""

    def columns(self, scene: Scene) -> VelocityIndices:
        """Return the indices of the velocities that the task commands.

        Parameters
        ----------
        scene : Scene
            True scene.

        Returns
        -------
        ndarray of int
            Indices of the velocities of the scene, in increasing order.
        """

    def bind(self, scene: Scene, columns: VelocityIndices | None = None) -> TaskController:
        """Return the controller of the task in a scene.

        Parameters
        ----------
        scene : Scene
            True scene.
        columns : ndarray of int, optional
            Indices of the commanded velocities, if several tasks share them. Default:
            `columns(scene)`.

        Returns
        -------
        TaskController
            The controller.

        Raises
        ------
        InputError or GoalError
            If the task is impossible in the scene.
        """


TaskLike = Task | str  # a task, or its name


@described
@dataclass(frozen=True, eq=False)
class ServoTask(CommandFields):
    """Base of the servo tasks: drive a feature error e = s - s_goal to zero.

    The features s depend on the pose of a camera relative to its target, and so on the joints,

        sdot = L (J_c - J_o) qdot = L J qdot.

    L (k, 6) is the interaction matrix of the features. J_c and J_o are the Jacobians of camera and
    target at the origin of the camera, in camera axes. J_o is 0 for a camera on the hand, J_c is 0
    for a fixed camera, and neither is 0 for a camera on another robot. The law chooses qdot so that
    e decays exponentially at the rate `gain`, as far as the joints allow (chapter, eqs. 5 to 8;
    Chaumette and Hutchinson 2006).

    `IBVS`, `PBVS`, `Hybrid`, `Partitioned`, `Placing` and `Docking` are servo tasks. A task of
    your own derives from this class and defines `features`, and optionally `law`, `gain` and
    `bound_law`. Derive it also from classes of `robsim.servo.tasks.task_fields` to get the fields
    of features, depth, law and weighting.

    `goal` is shown (at a configuration), computed (from a pose), or given as numbers. A shown goal
    is reached exactly even with a wrong calibration, since the true camera measures both the goal
    and the run.
    `belief` is the scene as the controller models it: the difference from the true scene is the
    modelling error.

    Raises
    ------
    InputError
        If fields contradict one another; by `bind`, if the scene lacks a name or a joint.
    GoalError
        By `bind`, if a mark of the goal is outside the image, or if s or L is not finite there.

    Warns
    -----
    RankWarning
        By `bind`, if the features leave motions of the commanded joints free.

    Examples
    --------
    >>> import robsim as rs
    >>> class Centre(rs.tasks.ServoTask):
    ...     features = rs.features.FeatureBlock("point_moments", components=[1, 2])
    ...     gain = 2.0
    >>> scenario = rs.load_scenario(rs.examples.path("watching_head"))
    >>> task = Centre(scenario.task.goal, tolerance=0.01)
    >>> run = rs.simulate(scenario.scene, task, scenario.start, duration=5)
    >>> rs.Outcome(int(run.outcome)).name
    'CONVERGED'
    """

    group: ClassVar[str] = "goal"
    goal: Annotated[
        Goal | None,
        GoalSpec(),
        "Goal: a configuration q at which it is shown (None: home), GoalPose or GoalFeatures.",
    ] = None
    camera: Annotated[
        Name | None,
        CAMERAS,
        "Name of the camera, or names of a stereo pair; None: the only camera.",
    ] = None
    target: Annotated[
        str | None, TARGET, "Name of the object with the marks; None: the only object."
    ] = None
    _: KW_ONLY
    tolerance: Annotated[
        float | None,
        Number(above=0),
        "Largest max|e| at convergence; None: the tolerance of each feature.",
    ] = None
    belief: Annotated[
        Scene | None, BeliefSpec(), "Scene as the controller models it; None: the true scene."
    ] = None
    detector: Annotated[
        MarkDetector | str | None,
        DETECTOR,
        "Detector of the marks in rendered pictures; None: exact image coordinates.",
    ] = None
    # defaults of tasks without these fields; Any: the classes of `task_fields` declare their types
    interaction = cast(Any, "current")
    inverse = cast(Any, PseudoInverse())
    feed_forward = cast(Any, None)
    weighting = cast(Any, ())
    depth = cast(Any, "true")
    depth_scale = cast(Any, 1.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_servo_fields(self)

    @property
    def features(self) -> Features:
        """Regulated features: one feature, or several features that are stacked."""
        raise CodeError(f"{type(self).__name__} needs features")

    @property
    def law(self) -> LawLike:
        """Law that maps the error e to joint velocities."""
        return JointLaw()

    @property
    def gain(self) -> float | AdaptiveGain:
        """Decay rate of e, in 1/s."""
        return 1.0

    @property
    def depths(self) -> DepthModel:
        """Depth of the marks in the features and in L."""
        return DepthModel(self.depth, self.depth_scale)

    @property
    def needs_depth(self) -> bool:
        """Whether a feature or its interaction matrix depends on the depth of the marks."""
        return any(getattr(block.feature, "uses_depth", True) for block in self.blocks)

    @classmethod
    def text_check(cls, raw: Mapping[str, Raw], c: Context) -> None:
        """Report a camera or a target that a text must name."""
        own, scene = c.facts["own"], c.facts.get("scene")
        features = own.get("features")
        blocks = make_feature_blocks(features) if features else [None]
        for key, find in (("camera", "camera"), ("target", "object")):
            unnamed = any(getattr(block, key, None) is None for block in blocks)
            if scene is not None and unnamed and own.get(key) is None and key not in raw:
                with c.problems.at(*c.path, key):
                    getattr(scene, find)(None)

    @cached_property
    def blocks(self) -> tuple[FeatureBlock, ...]:
        """Feature blocks of the task."""
        return make_feature_blocks(self.features)

    def columns(self, scene: Scene) -> VelocityIndices:
        """Return the indices of the commanded velocities.

        Parameters
        ----------
        scene : Scene
            True scene.

        Returns
        -------
        ndarray of int
            Velocities that move a camera of the task relative to its target, and that `joints`
            names.

        Raises
        ------
        InputError
            If the scene lacks a name, or if no joint moves the camera relative to the target.
        """
        columns = [s.columns for each in self.sights(scene) for s in each]
        return self.select_velocities(scene, make_read_only(np.unique(np.concatenate(columns))))

    def bind(self, scene: Scene, columns: VelocityIndices | None = None) -> ServoController:
        """Return the controller of the task in a scene, after checks of names, goal and fields.

        Parameters
        ----------
        scene : Scene
            True scene.
        columns : ndarray of int, optional
            Indices of the commanded velocities, if several tasks share them. Default:
            `columns(scene)`.

        Returns
        -------
        ServoController
            The controller.

        Raises
        ------
        InputError
            If the scene lacks a name or a joint, or if a field does not fit the scene.
        GoalError
            If the goal is outside the image, or if s or L is not finite there.

        Warns
        -----
        RankWarning
            If the features leave motions of the joints free, and `secondary` does not use them.
        """
        if columns is not None:
            return self._build_controller(scene, columns)
        controller = self._cached_controller(scene)
        if self.secondary is None:
            warn_of_rank(controller)
            self.warn_of_wheels(controller)
        return controller

    def _cached_controller(self, scene: Scene) -> ServoController:
        """Return the controller in a scene, or the last controller if nothing in it can change."""
        last: ServoController | None = vars(self).get("_last_controller")
        if last is not None and last.scene is scene:
            return last
        if not (scene.tree.compiled and self.holds_still):
            return self._build_controller(scene, self.columns(scene))
        last = self._reuse_controller(scene)
        vars(self)["_last_controller"] = last
        keep_controller(self, last)
        return last

    def _reuse_controller(self, scene: Scene) -> ServoController:
        """Return the controller in a scene, from parts of the last controller there if they fit."""
        kept = get_kept_controller(scene)
        changes = None if kept is None else kept.find_changes(self)
        if kept is None or changes is None or not changes <= OTHER_FIELDS:
            controller = self._build_controller(scene, self.columns(scene))
        elif not changes:
            return kept.controller
        elif changes == {"gain"} and (other := kept.replace_gain(self.gain)) is not None:
            return other
        else:
            old = kept.controller
            parts = old.sights, old.columns, old.bound_features, old.full_rank
            controller = self._complete_controller(*parts)
        vars(controller)[LAST_STEPS] = None  # it may keep its stages
        return controller

    def _build_controller(self, scene: Scene, columns: VelocityIndices) -> ServoController:
        """Return the controller of these velocities in a scene."""
        sights = self.sights(scene)
        regulated, truths = self.bind_features(sights, columns), deduplicate_targets(sights)
        return self._complete_controller(truths, columns, regulated)

    def _complete_controller(
        self,
        truths: tuple[CameraTarget, ...],
        columns: VelocityIndices,
        regulated: BoundFeatures,
        full_rank: Any = None,
    ) -> ServoController:
        """Return the controller of true camera-target pairs and bound features.

        `full_rank` is the rank at the goal, if it is known.
        """
        scene = truths[0].scene
        check_bound_law(self.law, self.interaction, regulated)
        check_weighting(self.weighting, regulated)
        s_goal = regulated.s_goal
        check_goal_interaction(cast(GoalKind, self.goal), regulated)
        own = regulated.tolerances
        tolerance = own if self.tolerance is None else np.full(own.shape, self.tolerance)
        check_feature_tolerance(tolerance, regulated)
        controller = ServoController(
            scene,
            truths[0].eye.name,
            truths,
            columns,
            s_goal,
            regulated.units,
            tolerance,
            regulated.goal_pixels,
            compute_decay_rate(regulated, self.gain, self.inverse),
            compute_goal_rank(regulated) if full_rank is None else full_rank,
            get_rcond(self.inverse),
            regulated,
            self.bound_law(regulated),
            self.gain,
            self.inverse,
            self.feed_forward,
            self.interaction if isinstance(self.interaction, Broyden) else None,
            self.shaping(scene, columns),
            self.weighting,
            cast(MarkDetector | None, self.detector),
        )
        bind = getattr(controller.law, "bind", None)
        return controller if bind is None else cast(ServoController, bind(controller))

    def sights(self, scene: Scene) -> BlockTargets:
        """Return the true camera-target pairs of each feature block, cached for the last scene.

        Parameters
        ----------
        scene : Scene
            True scene.

        Returns
        -------
        list of tuple of CameraTarget
            For each block, the pairs of its one or two cameras.
        """
        last: BlockTargets | None = vars(self).get("_last_sights")
        if last is None or last[0][0].scene is not scene:
            last = find_camera_targets(self, scene)
            vars(self)["_last_sights"] = last
        return last

    def bind_features(self, sights: BlockTargets, columns: VelocityIndices) -> BoundFeatures:
        """Return the features of the task in a scene.

        Parameters
        ----------
        sights : list of tuple of CameraTarget
            True camera-target pairs of each feature block, from `sights`.
        columns : ndarray of int
            Indices of the commanded velocities.

        Returns
        -------
        BoundFeatures
            Features with their goal, as the controller models them.

        Raises
        ------
        InputError or GoalError
            If the goal, the belief or the depth does not fit the scene.
        """
        return bind_features(self, sights, columns)

    def task_jacobian(self, scene: Scene, q: Configuration | None = None) -> InteractionMatrix:
        """Return the matrix L J of the law with respect to the commanded velocities.

        It is the matrix of sdot = L J qdot as the controller models it: with its belief, its model
        of L (`interaction`), its depths, and the weights of the features, for exact images. With
        Broyden's rule it is the model from which the estimate starts.

        Parameters
        ----------
        scene : Scene
            True scene.
        q : array_like of shape (..., nq) or dict, optional
            Coordinates of the scene. Default: `home`.

        Returns
        -------
        InteractionMatrix
            The numbers (..., k, n), with the names of features and velocities.

        Raises
        ------
        InputError or GoalError
            If the task is impossible in the scene.

        Examples
        --------
        >>> import robsim as rs
        >>> one = rs.load_scenario(rs.examples.path("eye_in_hand"))
        >>> LJ = one.task.task_jacobian(one.scene, one.start)
        >>> LJ.shape, LJ.rank
        ((8, 7), 6)
        >>> LJ.rows[0], LJ.columns[6], len(LJ.free_motions())
        ('x of mark 0', 'link7', 1)
        """
        values = scene.coordinates(scene.home if q is None else q)
        controller = self._cached_controller(scene)
        matrices = compute_controller_matrices(controller, move_runs_last(values, 1))
        LJ = matrices.task_jacobian
        return replace(LJ, matrix=LJ.matrix.reshape(*values.shape[:-1], *LJ.shape[1:]))

    def warn_of_wheels(self, controller: ServoController) -> None:
        """Issue a RankWarning if a unicycle alone has more features than velocities."""
        warn_of_wheels(controller)

    def bound_law(self, regulated: BoundFeatures) -> Law:
        """Return the law in a scene.

        Parameters
        ----------
        regulated : BoundFeatures
            Features of the task in the scene.

        Returns
        -------
        Law
            The field `law`. Some tasks return a law that depends on the scene.
        """
        return cast(Law, self.law)
