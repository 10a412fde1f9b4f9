"""The fields of every servo task, and how it is bound to a scene."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np

from robsim.base.arrays import frozen, positive
from robsim.features import Points
from robsim.servo.controller import Controller
from robsim.servo.feature_block import FeatureBlock, as_cameras, as_parts
from robsim.servo.goals.goal import as_goal
from robsim.servo.laws.broyden import Broyden
from robsim.servo.laws.depths import Depth, Depths, as_depth, as_scale
from robsim.servo.laws.feed_forward import as_feed_forward
from robsim.servo.laws.gain import AdaptiveGain, as_gain
from robsim.servo.laws.interaction import as_interaction
from robsim.servo.laws.inverse import as_inverse
from robsim.servo.laws.law import as_law
from robsim.servo.regulated import Regulated
from robsim.servo.servo_controller import Servo, pace, rank_at_goal, rcond_of
from robsim.servo.shaping.shaped import Columns, Shaped
from robsim.servo.tasks.binding import Found, each_once, regulated_by, sights_of
from robsim.servo.tasks.soundness import (
    check_goal,
    check_law,
    check_own_law,
    warn_of_rank,
    warn_of_wheels,
)
from robsim.world.scene import Scene


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
class ServoTask(Shaped):
    """Drive e = s - s_goal to zero: what IBVS, PBVS and their kin have in common."""

    own_law: ClassVar[bool] = False  # that takes no inverse, feed-forward or Broyden's rule
    goal: Any = None
    camera: Any = None
    target: str | None = None
    features: Any = field(default_factory=Points)
    interaction: Any = "current"
    depth: Depth = "true"
    depth_scale: Any = 1.0
    law: Any = "joint"
    gain: float | AdaptiveGain = 1.0
    inverse: Any = "pseudo_inverse"
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
        bare = len(parts) == 1 and not isinstance(self.features, FeatureBlock | list | tuple)
        put(self, "features", parts[0].feature if bare else parts)
        put(self, "law", as_law(self.law))
        put(self, "inverse", as_inverse(self.inverse))
        put(self, "gain", as_gain(self.gain))
        put(self, "depth_scale", as_scale(self.depth_scale))
        put(self, "depth", as_depth(self.depth))
        put(self, "interaction", as_interaction(self.interaction))
        put(self, "feed_forward", as_feed_forward(self.feed_forward))
        if self.tolerance is not None:
            put(self, "tolerance", positive(self.tolerance, "tolerance"))

    @property
    def parts(self) -> tuple[FeatureBlock, ...]:
        """All features with who sees them."""
        return as_parts(self.features)

    def columns(self, scene: Scene) -> Columns:
        """The velocities that move a camera of the task against its target."""
        found = [s.columns for each in self.sights(scene) for s in each]
        return self.chosen(scene, frozen(np.unique(np.concatenate(found))))

    def bind(self, scene: Scene, columns: Columns | None = None) -> Servo:
        """The controller of this task in a scene; every name and the goal are checked here.

        RankWarning: the features do not fix every motion that the joints can make.
        """
        shared = columns is not None
        columns = self.columns(scene) if columns is None else columns
        sights = self.sights(scene)
        regulated, truths = self.regulated(sights, columns), each_once(sights)
        if self.own_law:
            check_own_law(type(self).__name__, self.inverse, self.feed_forward, self.interaction)
        check_law(self.law, self.inverse, self.feed_forward, self.interaction, regulated)
        s_goal = regulated.s_goal
        check_goal(self.goal, self.depth, self.interaction, regulated)
        own = regulated.tolerances
        controller = Servo(
            scene,
            truths[0].eye.name,
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
            warn_of_rank(controller)
            self.warn_of_wheels(controller)
        return controller

    def sights(self, scene: Scene) -> Found:
        """The true sights of each feature block."""
        return sights_of(self.parts, self.camera, self.target, scene)

    def regulated(self, sights: Found, columns: Columns) -> Regulated:
        """What the task regulates with its true sights; InputError or GoalError if it cannot."""
        depths = Depths(self.depth, self.depth_scale)
        return regulated_by(
            self.parts, self.goal, depths, self.interaction, self.belief, sights, columns
        )

    def warn_of_wheels(self, controller: Servo) -> None:
        """RankWarning if a unicycle alone is asked for more than it can do."""
        warn_of_wheels(controller)

    def bound_law(self, regulated: Regulated) -> Any:
        """The law, which may need to know the scene."""
        return self.law
