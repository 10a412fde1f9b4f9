"""The fields of every servo task, and how it is bound to a scene."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar, Protocol, cast, runtime_checkable

import numpy as np

from robsim.base.arrays import make_read_only
from robsim.declare import Number, described
from robsim.declare.spec import Context
from robsim.servo.bound_features import BoundFeatures
from robsim.servo.feature_block import CAMERAS, TARGET, FeatureBlock, make_feature_blocks
from robsim.servo.goals.goal import GoalSpec
from robsim.servo.laws.broyden_rule import Broyden
from robsim.servo.laws.depth_model import DepthModel
from robsim.servo.laws.inverse import PseudoInverse
from robsim.servo.laws.law import JointLaw
from robsim.servo.servo_controller import (
    ServoController,
    compute_decay_rate,
    compute_goal_rank,
    get_rcond,
)
from robsim.servo.shaping.command_fields import CommandFields, VelocityIndices
from robsim.servo.task_controller import TaskController
from robsim.servo.tasks.belief_spec import BeliefSpec
from robsim.servo.tasks.feature_binder import (
    BlockTargets,
    bind_features,
    deduplicate_targets,
    find_camera_targets,
)
from robsim.servo.tasks.task_checks import (
    check_bound_law,
    check_feature_tolerance,
    check_goal_interaction,
    check_servo_fields,
    warn_of_rank,
    warn_of_wheels,
)
from robsim.servo.weightings.mark_dependencies import check_weighting
from robsim.world.scene import Scene


@runtime_checkable
class Task(Protocol):
    """The interface of a task: what can be simulated in a scene."""

    def columns(self, scene: Scene) -> VelocityIndices:
        """Return the velocities that the task commands."""

    def bind(self, scene: Scene, columns: VelocityIndices | None = None) -> TaskController:
        """Return the controller of the task; InputError or GoalError if it makes no sense there.

        `columns` are the velocities that are commanded where several tasks share them.
        """


@described
@dataclass(frozen=True, eq=False)
class ServoTask(CommandFields):
    """Drive e = s - s_goal to zero: the base of IBVS, PBVS and other servo tasks.

    It has the fields that act on every one of them; `robsim.servo.tasks.task_fields` has the others. A
    task of your own gives `features`, and as far as it wants the other properties.
    """

    group: ClassVar[str] = "goal"
    goal: Annotated[
        Any, GoalSpec(), "Goal: the q at which it is shown (None: home), GoalPose or GoalFeatures."
    ] = None
    camera: Annotated[
        Any, CAMERAS, "Name of the camera, or of the two of a stereo pair; None: the only one."
    ] = None
    target: Annotated[
        str | None, TARGET, "Name of the object with the marks; None: the only one."
    ] = None
    _: KW_ONLY
    tolerance: Annotated[
        float | None, Number(above=0), "Largest max|e| at convergence; None: the features' own."
    ] = None
    belief: Annotated[
        Scene | None, BeliefSpec(), "Scene as the controller believes it; None: the true one."
    ] = None
    # of a task without such fields
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
    def features(self) -> Any:
        """The features that are regulated: one, or several, which are stacked."""
        raise NotImplementedError(f"{type(self).__name__} needs features")

    @property
    def law(self) -> Any:
        """The law from e to joint velocities."""
        return JointLaw()

    @property
    def gain(self) -> Any:
        """The rate at which e falls."""
        return 1.0

    @property
    def depths(self) -> DepthModel:
        """The depth of the marks that the features and L are made with."""
        return DepthModel(self.depth, self.depth_scale)

    @property
    def needs_depth(self) -> bool:
        """Whether the depth of the marks enters a feature or its interaction matrix."""
        return any(getattr(block.feature, "uses_depth", True) for block in self.blocks)

    @classmethod
    def text_check(cls, raw: Any, c: Context) -> None:
        """Report a camera or target that a text must name."""
        own, scene = c.facts["own"], c.facts.get("scene")
        given = own.get("features")
        blocks = make_feature_blocks(given) if given else [None]
        for key, find in (("camera", "camera"), ("target", "object")):
            unnamed = any(getattr(block, key, None) is None for block in blocks)
            if scene is not None and unnamed and own.get(key) is None and key not in raw:
                with c.problems.at(*c.path, key):
                    getattr(scene, find)(None)

    @cached_property
    def blocks(self) -> tuple[FeatureBlock, ...]:
        """The feature blocks of the task."""
        return make_feature_blocks(self.features)

    def columns(self, scene: Scene) -> VelocityIndices:
        """Return the velocities that move a camera of the task relative to its target."""
        found = [s.columns for each in self.sights(scene) for s in each]
        return self.chosen(scene, make_read_only(np.unique(np.concatenate(found))))

    def bind(self, scene: Scene, columns: VelocityIndices | None = None) -> ServoController:
        """Return the controller of the task in a scene, with every name and the goal checked.

        RankWarning: the features do not fix every motion that the joints can make.
        """
        if columns is not None:
            return self._controller(scene, columns)
        controller = self._own_controller(scene)
        if self.secondary is None:
            warn_of_rank(controller)
            self.warn_of_wheels(controller)
        return controller

    def _own_controller(self, scene: Scene) -> ServoController:
        """Return the controller in a scene; the last one again where nothing in it can change."""
        last = vars(self).get("_last")
        if last is None or last.scene is not scene:
            last = self._controller(scene, self.columns(scene))
            if scene.tree.compiled and self.holds_still:
                vars(self)["_last"] = last
        return last

    def _controller(self, scene: Scene, columns: VelocityIndices) -> ServoController:
        """Return the controller of these velocities in a scene."""
        sights = self.sights(scene)
        regulated, truths = self.regulated(sights, columns), deduplicate_targets(sights)
        check_bound_law(self.law, self.interaction, regulated)
        check_weighting(self.weighting, regulated)
        s_goal = regulated.s_goal
        check_goal_interaction(self.goal, regulated)
        own = regulated.tolerances
        tolerance = own if self.tolerance is None else np.full(own.shape, self.tolerance)
        check_feature_tolerance(tolerance, regulated)
        return ServoController(
            scene,
            truths[0].eye.name,
            truths,
            columns,
            s_goal,
            regulated.units,
            tolerance,
            regulated.goal_pixels,
            compute_decay_rate(regulated, self.gain, self.inverse),
            compute_goal_rank(regulated),
            get_rcond(self.inverse),
            regulated,
            self.bound_law(regulated),
            self.gain,
            self.inverse,
            self.feed_forward,
            self.interaction if isinstance(self.interaction, Broyden) else None,
            self.shaping(scene, columns),
            self.weighting,
        )

    def sights(self, scene: Scene) -> BlockTargets:
        """Return the true sights of each feature block; those of the last scene are kept."""
        last: BlockTargets | None = vars(self).get("_sights")
        if last is None or last[0][0].scene is not scene:
            last = find_camera_targets(self, scene)
            vars(self)["_sights"] = last
        return last

    def regulated(self, sights: BlockTargets, columns: VelocityIndices) -> BoundFeatures:
        """Return what the task regulates with its true sights; InputError if it cannot."""
        return bind_features(self, sights, columns)

    def warn_of_wheels(self, controller: ServoController) -> None:
        """Warn with RankWarning if a unicycle alone is asked for more than it can do."""
        warn_of_wheels(controller)

    def bound_law(self, regulated: BoundFeatures) -> Any:
        """Return the law, which in some tasks depends on the scene."""
        return self.law
