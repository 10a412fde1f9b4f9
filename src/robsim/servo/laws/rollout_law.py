"""The law that looks ahead: it predicts the motion of candidates and commands the best of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Annotated, Any, cast

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.declare import DeclaredValue, KindOf, ListOf, Number, PerRun, Time, register
from robsim.declare.problems import prefix_path
from robsim.servo.goals.goal import GoalFeatures
from robsim.servo.laws.command_quantity import require_velocity_laws
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.law import LAWS, Law, LawLike
from robsim.servo.rollout_controller import RolloutSettings, make_rollout_controller
from robsim.servo.servo_controller import ServoController
from robsim.servo.tasks.task import ServoTask, Task, TaskLike
from robsim.servo.tasks.task_choice import TASKS, TaskChoice

MOST_CANDIDATES = 16
MOST_INSTANTS = 2000  # of a prediction
SCHEMES = "ibvs", "pbvs", "hybrid", "partitioned"


@register("law", "rollout")
@dataclass(frozen=True, eq=False)
class RolloutLaw(DeclaredValue):
    """Law that looks ahead: predict the motion under several laws, and command the best one.

    Every `period` the stages of the engine predict the motion under each candidate, in the believed
    scene from the measured coordinates, over `horizon`. A candidate is feasible if all marks stay
    `margin` pixels inside the image and in front of the camera, and all joints within their limits,
    at each predicted instant. The feasible candidate that ends nearest to the goal commands until
    the next prediction. The distance at the end is the root mean square distance of the N marks
    from their goal, in camera axes,

        d = sqrt(sum_i |X_i - X_i*|^2 / N),

    in metres (as the average distance of a model in pose estimation; Hinterstoisser et al. 2012).
    The error in the image does not serve: it also falls while the camera retreats. If no candidate
    is feasible, the candidate that stays feasible longest commands. If the horizon is several time
    constants 1/gain and the model is exact, then a candidate that is predicted to arrive remains
    feasible, and the run arrives with all marks in view.

    Candidates are the `laws` with the features and the gain of the task, and other `schemes`: servo
    tasks with features, gain and law of their own, for the goal, camera, target, belief and joints
    of the task, and with its weighting unless they have one.

    A longer `horizon` foresees more and costs more time. A shorter `period` predicts and reacts
    more finely. `hysteresis` prevents changes between equally good candidates.

    Raises
    ------
    InputError
        If there are too many predicted instants; by `simulate`, if a candidate does not fit the
        scene, if the goal is given as numbers, or if a feature reads pictures.

    Notes
    -----
    The prediction assumes exact images and joints that follow their commands at once. A law in
    Python starts from its present memory, and constraints from the last command; Broyden's estimate
    and a depth filter start anew.

    Examples
    --------
    Image-based servoing retreats from a turn about the optical axis, the other scheme does not:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("camera_retreat"))
    >>> law = RolloutLaw(["joint"], schemes=[rs.PBVS(form="camera")], horizon=5.0)
    >>> for each in "joint", law:
    ...     run = scenario.at("task.law", each).run()
    ...     print(rs.Outcome(int(run.outcome)).name, f"{float(run.path_length):.2f} m")
    CONVERGED 2.03 m
    CONVERGED 0.00 m
    """

    laws: Annotated[
        Sequence[LawLike],
        ListOf(KindOf(LAWS, protocol=Law), 1, MOST_CANDIDATES),
        "Laws that are predicted with the features and the gain of the task.",
    ] = ("joint",)
    schemes: Annotated[
        Sequence[TaskLike],
        ListOf(TaskChoice(TASKS, only=SCHEMES, protocol=Task), 0, MOST_CANDIDATES),
        "Servo tasks that are predicted with their own features, gain and law.",
    ] = ()
    horizon: Annotated[float, Time(above=0), "Predicted time, in seconds."] = 5.0
    period: Annotated[
        float, Time(above=0), "Step of the prediction and time between two predictions, in seconds."
    ] = 0.1
    margin: Annotated[
        float | Array,
        Number(least=0.0, unit="px"),
        PerRun(()),
        "Distance of the marks from the border of the image, in pixels.",
    ] = 4.0
    hysteresis: Annotated[
        float,
        Number(least=0.0, below=1.0),
        "Share by which another candidate must end nearer to the goal to take over.",
    ] = 0.1

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.horizon / self.period > MOST_INSTANTS:
            raise InputError(
                f"RolloutLaw: a horizon of {self.horizon:g} s in steps of {self.period:g} s has "
                f"more than {MOST_INSTANTS} steps"
            )
        for each in self.schemes:
            if not isinstance(each, ServoTask):
                raise InputError(f"schemes: expected a servo task, got {format_value(each)}")
        free = [replace(cast(Any, each), belief=None) for each in self.schemes]
        object.__setattr__(self, "schemes", tuple(free))  # the belief is that of the task
        candidates = *self.laws, *(cast(ServoTask, each).law for each in self.schemes)
        require_velocity_laws(candidates, "RolloutLaw")
        for law in candidates:
            if isinstance(law, RolloutLaw):
                raise InputError("RolloutLaw: a candidate cannot be a RolloutLaw")

    @property
    def in_camera(self) -> bool:
        """Whether a law reads the interaction matrix of one camera."""
        return any(getattr(law, "in_camera", False) for law in self.laws)

    def command(self, state: ControlState) -> Array:
        """Raise InputError: a prediction needs the scene of a task.

        Parameters
        ----------
        state : ControlState
            Error, interaction matrix and Jacobian of B runs.

        Returns
        -------
        ndarray of shape (B, n)
            Never.

        Raises
        ------
        InputError
            Always.
        """
        raise InputError("RolloutLaw.command: a prediction needs a scene; use the law in a task")

    def bind(self, controller: ServoController) -> ServoController:
        """Return the controller that predicts all candidates.

        Parameters
        ----------
        controller : ServoController
            Controller of a task in a scene.

        Returns
        -------
        ServoController
            The controller with the prediction.

        Raises
        ------
        InputError
            If a candidate does not fit the scene.
        """
        features = controller.bound_features
        if isinstance(features.goal_views.goal, GoalFeatures):
            raise InputError(
                "RolloutLaw: a goal given as numbers has no pose; show or compute the goal"
            )
        candidates = [_bind_law(cast(Law, law), controller) for law in self.laws]
        for i, scheme in enumerate(self.schemes):
            with prefix_path("law", "schemes", i):
                candidates.append(_bind_scheme(cast(ServoTask, scheme), controller))
        if any(each.pictured_pairs for each in (controller, *candidates)):
            raise InputError("RolloutLaw: features of pictures cannot be predicted")
        settings = RolloutSettings(self.horizon, self.period, self.margin, self.hysteresis)
        self._check_period(candidates)
        return make_rollout_controller(controller, tuple(candidates), settings)

    def _check_period(self, candidates: Sequence[ServoController]) -> None:
        """Raise InputError if a predicted step is longer than the time constant of a candidate."""
        fastest = max(float(np.max(each.pace)) for each in candidates)
        if fastest * self.period > 1.0:
            raise InputError(
                f"RolloutLaw: steps of {self.period:g} s are too long for a gain of {fastest:g}/s; "
                f"use a period of at most {1.0 / fastest:.3g} s"
            )


def _bind_law(law: Law, controller: ServoController) -> ServoController:
    """Return a controller with another law."""
    bind: Any = getattr(law, "bind", None)
    candidate = replace(controller, law=law)
    return candidate if bind is None else cast(ServoController, bind(candidate))


def _bind_scheme(scheme: ServoTask, controller: ServoController) -> ServoController:
    """Return the controller of a scheme for the goal, pair and velocities of another controller."""
    features = controller.bound_features
    camera, target = controller.sights[0].key
    weighted = any(each.name == "weighting" for each in fields(cast(Any, scheme)))
    inherited = {"weighting": controller.weighting} if weighted and not scheme.weighting else {}
    task = replace(
        cast(Any, scheme),
        goal=features.goal_views.goal,
        camera=scheme.camera or camera,
        target=scheme.target or target,
        belief=None if features.exact else features.sights[0].scene,
        **inherited,
    )
    candidate: ServoController = task.bind(controller.scene, controller.columns)
    known = [sight.key for sight in controller.sights]
    for key in (sight.key for sight in candidate.sights):
        if key not in known:
            raise InputError(f"camera '{key[0]}' and target '{key[1]}' are not those of the task")
    if controller.optional_pairs - candidate.optional_pairs:
        raise InputError(
            "it needs all marks, and the weighting of the task lets marks leave the image"
        )
    return candidate
