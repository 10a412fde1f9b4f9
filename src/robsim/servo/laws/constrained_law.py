"""The law with constraints: the command nearest to the wish of another law that satisfies them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal, cast

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, KindOf, Number, Word, register
from robsim.servo.constraints.constraint import ConstraintPlace
from robsim.servo.constraints.constraint_stages import BoundConstraints
from robsim.servo.constraints.joint_limits import JointLimits
from robsim.servo.constraints.user_constraint import (
    CONSTRAINT_LIST,
    ConstraintLike,
    adapt_constraint,
)
from robsim.servo.laws.command_quantity import require_velocity_laws
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.law import LAWS, Law, LawLike
from robsim.servo.servo_controller import ServoController


@register("law", "constrained")
@dataclass(frozen=True)
class ConstrainedLaw(DeclaredValue):
    """Law within constraints: the command nearest to the wish of another law.

    With the command `wish` of the law after all shaping, such as a secondary motion, the command
    minimises

        ||A (qdot - wish)||^2 + joint_weight (tr A'A / n) ||qdot - wish||^2

    subject to all constraints (a control-barrier quadratic program; Ames et al. 2019). A = L J is
    the task Jacobian, so the features change as the scheme wishes as far as possible. A wish that
    satisfies all constraints is the command, bit for bit.

    Constraints of joints always hold. If no command satisfies the other rows, the rows of the view
    get one common excess with a price; if that is not enough, the rows of space get it too, and
    then all rows. `run.active` holds the multiplier of each constraint, positive where the
    constraint holds the command back, and `run.slack` the excess of each row that gave way.

    Raises
    ------
    InputError
        If a law within constraints is the law of another; by `simulate`, if a constraint does not
        fit the scene.

    Notes
    -----
    The metric "joint", ||qdot - wish||^2, spoils the direction of the error and stands still in
    more runs. The problem is solved by the dual method of Goldfarb and Idnani (1983).

    Examples
    --------
    >>> import robsim as rs
    >>> law = ConstrainedLaw([rs.constraints.JointSpeeds(0.2)])
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> run = scenario.at("task.law", law).run()
    >>> run.active.sizes["constraint"], rs.Outcome(int(run.outcome)).name
    (12, 'CONVERGED')
    """

    constraints: Annotated[
        Sequence[ConstraintLike],
        CONSTRAINT_LIST,
        "Constraints that the command satisfies; by default, of the coordinates of joints.",
    ] = (JointLimits(),)
    law: Annotated[
        LawLike,
        KindOf(LAWS, default="joint", protocol=Law),
        "Law of the wish: a kind, or an object with command.",
    ] = "joint"
    metric: Annotated[
        Literal["error", "joint"],
        Word(("error", "joint")),
        "Measure of the distance to the wish: by the change of the features, or of the joints.",
    ] = "error"
    joint_weight: Annotated[
        float,
        Number(above=0.0),
        "Weight of the distance of the velocities beside that of the features.",
    ] = 1e-4

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.law, ConstrainedLaw):
            raise InputError("constraints within constraints: give all of them in one list")
        require_velocity_laws([self.law], "ConstrainedLaw")
        if hasattr(self.law, "bind"):
            raise InputError(
                f"law: {type(self.law).__name__} chooses among laws, and constraints belong to its "
                "candidates: give it laws with constraints"
            )

    @property
    def in_camera(self) -> bool:
        """Whether the law of the wish reads the interaction matrix of one camera."""
        return bool(getattr(self.law, "in_camera", False))

    def command(self, state: ControlState) -> Array:
        """Raise InputError: constraints need the scene of a task.

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
        raise InputError(
            "ConstrainedLaw.command: constraints need the scene of a task; use the law in a task, "
            "or call the command of its inner law"
        )

    def bind(self, controller: ServoController) -> ServoController:
        """Return a controller whose command satisfies the constraints.

        Parameters
        ----------
        controller : ServoController
            Controller of a task in a scene.

        Returns
        -------
        ServoController
            The controller with the law of the wish and the constraints.

        Raises
        ------
        InputError
            If a constraint does not fit the scene.
        """
        bound = self.bind_constraints(controller.constraint_place)
        return replace(controller, law=cast(Law, self.law), constraints=bound)

    def bind_constraints(self, place: ConstraintPlace) -> BoundConstraints:
        """Return the constraints in a scene; raise InputError if one does not fit it.

        Parameters
        ----------
        place : ConstraintPlace
            Believed scene, camera-target pairs and commanded velocities.

        Returns
        -------
        BoundConstraints
            The constraints with their names.

        Raises
        ------
        InputError
            If a constraint does not fit the scene.
        """
        constraints = tuple(map(adapt_constraint, self.constraints))
        bound = BoundConstraints(constraints, place, self.metric == "error", self.joint_weight)
        assert bound.labels is not None  # raises InputError
        return bound
