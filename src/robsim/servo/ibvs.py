"""Image-based visual servoing."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np

from robsim.arrays import positive
from robsim.errors import InputError, RankWarning, suggest
from robsim.features import FEATURES, Feature, Points
from robsim.scene import Scene
from robsim.servo.controller import Controller, Depth, Interaction
from robsim.servo.goal import as_goal, view_of
from robsim.servo.inverse import as_inverse, rank
from robsim.servo.law import as_law
from robsim.servo.sight import Sight, sight


@dataclass(frozen=True)
class IBVS:
    """Regulate image features: edot = -gain e, as well as the robot can (chapter, eqs. 5 to 8).

    goal          q at which the goal is shown (None: home), or `Computed(T_c_o)`
    camera        name of the camera, target: name of the object with the marks; None: the only one
    features      "points", "pixels", `Points()`, `PixelPoints()`, or any object with measure and
                  interaction
    interaction   L "current", "desired" or "mean" of the two
    depth         Z in L: "true", "goal" (its value there) or metres; times depth_scale
    law           "joint", "camera", `CameraLaw(length)`, or any object with command
    gain          per second
    inverse       "truncated", "damped", `Truncated(rcond)` or `Damped(damping)`
    tolerance     converged when max|e| is below; None: the feature's own
    belief        a Scene with the same names, as the controller believes it; None: the truth

    >>> IBVS(goal=[0, 0], interaction="mean").gain
    1.0
    """

    goal: Any = None
    camera: str | None = None
    target: str | None = None
    features: Any = field(default_factory=Points)
    interaction: Interaction = "current"
    depth: Depth = "true"
    depth_scale: float = 1.0
    law: Any = "joint"
    gain: float = 1.0
    inverse: Any = "truncated"
    tolerance: float | None = None
    belief: Scene | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "goal", as_goal(self.goal))
        if isinstance(self.features, str):
            put(self, "features", _named(self.features))
        put(self, "law", as_law(self.law))
        put(self, "inverse", as_inverse(self.inverse))
        put(self, "gain", positive(self.gain, "gain (per second)"))
        put(self, "depth_scale", positive(self.depth_scale, "depth_scale"))
        put(self, "depth", _checked_depth(self.depth))
        if self.tolerance is not None:
            put(self, "tolerance", positive(self.tolerance, "tolerance"))
        if self.interaction not in get_args(Interaction):
            kinds = suggest(self.interaction, get_args(Interaction), "choices")
            raise InputError(f"no interaction matrix {self.interaction!r}; {kinds}")
        if isinstance(self.features, type) or not isinstance(self.features, Feature):
            raise InputError(
                f"features: expected Points(), PixelPoints() or an object with unit, tolerance, "
                f"measure and interaction, got {self.features!r:.80}"
            )

    def bind(self, scene: Scene) -> Controller:
        """The controller of this task in a scene; every name and the goal are checked here.

        RankWarning: the features do not fix every motion that the joints can make.
        """
        truth = sight(scene, self.camera, self.target)
        belief = truth
        if self.belief is not None and self.belief != scene:
            belief = _believed(self.belief, truth)
        if len(belief.target.marks) != len(truth.target.marks):
            raise InputError(
                f"the belief has {len(belief.target.marks)} marks on '{truth.target.name}', "
                f"the scene {len(truth.target.marks)}"
            )
        controller = Controller(
            truth,
            belief,
            self.features,
            self.interaction,
            self.depth,
            self.depth_scale,
            self.law,
            self.gain,
            self.inverse,
            positive(self.tolerance or self.features.tolerance, "tolerance"),
            view_of(self.goal, truth, belief),
        )
        _warn_of_rank(controller)
        return controller


def _named(features: str) -> Any:
    if features not in FEATURES:
        raise InputError(f"no features {features!r}; {suggest(features, FEATURES, 'features')}")
    chosen: Any = FEATURES[features]()
    return chosen


def _checked_depth(depth: Any) -> Depth:
    if isinstance(depth, str):
        if depth not in ("true", "goal"):
            raise InputError(f"depth must be 'true', 'goal' or a number of metres, got {depth!r}")
        return depth  # type: ignore[return-value]
    return positive(depth, "depth (metres)")


def _believed(belief: Any, truth: Sight) -> Sight:
    """A belief may differ in every number, but not in what there is."""
    if not isinstance(belief, Scene):
        raise InputError(f"belief must be a Scene (see Scene.replacing), got {belief!r:.80}")
    there, here = _joints(belief), _joints(truth.scene)
    if there != here:
        raise InputError(f"the belief has the joints {there}, the scene {here}")
    try:
        return sight(belief, truth.eye.name, truth.target.name)
    except InputError as error:
        raise InputError(f"belief: {error}") from None


def _joints(scene: Scene) -> list[str]:
    """Coordinates with their units: two joints of one name may be of different kinds."""
    both = zip(scene.coordinate_names, scene.coordinate_units, strict=True)
    return [f"{name} ({unit})" for name, unit in both]


def _warn_of_rank(controller: Controller) -> None:
    full, found = min(6, controller.belief.columns.size), controller.full_rank
    if controller.goal.q is None:  # computed: there is no Jacobian at the goal
        found = int(rank(controller.L_goal)[0])
    if found < full:
        marks = np.unique(controller.truth.target.marks, axis=0)
        cause = "its marks lie on one line; " if _collinear(marks) else ""
        warnings.warn(
            f"the features of '{controller.truth.target.name}' fix only {found} of the {full} "
            f"motions of camera '{controller.truth.eye.name}' at the goal: {cause}"
            "use at least three marks that are not on one line",
            RankWarning,
            stacklevel=4,
        )


def _collinear(marks: Any) -> bool:
    return int(np.linalg.matrix_rank(marks - marks[:1], tol=1e-9)) < 2
