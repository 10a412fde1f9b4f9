"""Control laws, which map the feature error to joint velocities.

An arm with fewer than six joints cannot realise every camera twist, so the laws
"v = -gain L^+ e, then qdot = J^+ v" and "qdot = -gain (L J)^+ e" differ. The chapter (section 6.1)
uses the first law; the second descends the error on every robot.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Protocol, runtime_checkable

from robsim.base.arrays import Array
from robsim.declare import DeclaredValue, KindOf, Length, PerRun, family, register
from robsim.kernels.control import control_law
from robsim.servo.laws.compiled_law import (
    CommandAtGain,
    CompiledLaw,
    LawRows,
    add_joint_velocities,
    scale_by_gain,
)
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.inverse import CAMERA_TWIST, SAME_UNITS, add_inverse

LAWS = family("law")
UnitOfLength = Annotated[
    float,
    Length(above=0),
    PerRun(()),
    "Length, in metres, that makes speeds and turn rates comparable in least squares.",
]


@runtime_checkable
class Law(Protocol):
    """Protocol of a control law; a class of a user needs no base class.

    The attribute `in_camera = True` declares that the law reads `state.interaction` and
    `state.jacobian`. They exist only if all cameras of the task move as one.
    The attribute `command_quantity = "torque"` declares that `command` returns torques in N m and
    forces in N, which need a drive such as `rs.drives.TorqueInput`.
    `robsim.testing.check_law` checks a law.

    Examples
    --------
    >>> import robsim as rs
    >>> class Slower:
    ...     def command(self, state):
    ...         return 0.5 * rs.laws.JointLaw().command(state)
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> for law in rs.laws.JointLaw(), Slower():
    ...     task = rs.IBVS(scenario.task.goal, law=law)
    ...     run = rs.simulate(scenario.scene, task, scenario.start, duration=25)
    ...     print(f"{float(run.end_time):.1f} s")
    10.1 s
    20.4 s
    """

    def command(self, state: ControlState) -> Array:
        """Return the velocities of the commanded joints, or their torques.

        Parameters
        ----------
        state : ControlState
            Error, interaction matrix and Jacobian of B runs.

        Returns
        -------
        ndarray of shape (B, n)
            Velocities in rad/s or m/s; torques in N m or N if `command_quantity` is "torque".
        """


@register("law", "joint")
@dataclass(frozen=True)
class JointLaw(CompiledLaw):
    """Joint law: descend the error in the joints, qdot = -gain (L J)^+ e.

    The pseudo-inverse of the task Jacobian L J gives the joint velocities that reduce the error
    best in the sense of least squares (chapter, eq. 8 applied to L J). On a robot with six or more
    joints the error decays as with `CameraLaw`; with fewer joints this law still descends the
    error, and may stop only at a true local minimum. It is the default law and the only law for
    several cameras that move independently.

    Examples
    --------
    >>> from robsim.laws import ControlState
    >>> L, J = np.eye(2, 6), np.eye(6, 2)
    >>> JointLaw().command(ControlState.of([0.1, -0.2], L, J, gain=0.5))
    array([[-0.05,  0.1 ]])
    """

    in_camera: ClassVar[bool] = False

    def stages(self, of: LawRows) -> CommandAtGain:
        """Add the stages of (L J)^+ e; return a function that adds the command for a gain."""
        transposed, damping, rcond = of.inverse.numbers
        if of.product is None or min(of.k, of.n) <= 6 or transposed or damping > 0.0:
            moves = of.J if of.one_motion else SAME_UNITS
            return scale_by_gain(of, add_inverse(of.program, of.A, of.error, of.inverse, moves))
        return scale_by_gain(of, of.product.solve(of.error, rcond))


@register("law", "camera")
@dataclass(frozen=True)
class CameraLaw(CompiledLaw, DeclaredValue):
    """Camera law: command a camera twist V = -gain L^+ e, then qdot = J^+ V.

    This is the law of the chapter (eqs. 8 and 19). It equals `JointLaw` if the features
    fix all six motions of the camera and the robot can realise every camera twist. A robot with
    fewer joints realises the nearest twist, which need not reduce the error: the run may stall
    away from the goal.

    Least squares over a twist depends on the unit of length: it weighs |v|^2/length^2 against
    |omega|^2. A larger `length` allows faster translations for the same rotation. The chapter uses
    a centimetre.

    Raises
    ------
    InputError
        If the task has `Broyden`; by `simulate`, if the cameras of the task do not move as one.

    Examples
    --------
    An arm with five joints, and a law that needs six:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("camera_law_stalls"))
    >>> for law in rs.laws.CameraLaw(), rs.laws.JointLaw():
    ...     task = rs.IBVS(scenario.task.goal, law=law)
    ...     run = rs.simulate(scenario.scene, task, scenario.start, duration=80)
    ...     print(rs.Outcome(int(run.outcome)).name)
    LOCAL_MINIMUM
    CONVERGED
    """

    length: UnitOfLength = 1.0
    in_camera: ClassVar[bool] = True

    def stages(self, of: LawRows) -> CommandAtGain:
        """Add the stages of J^+ L^+ e; return a function that adds the command for a gain."""
        program, unit = of.program, of.program.number(self.length)
        L = program.result(control_law.scale_length_unit, "B", of.k, 6, A=of.L, length=unit, mode=1)
        V = add_inverse(program, L, of.error, of.inverse, CAMERA_TWIST)
        program.add(control_law.scale_length_unit, A=V.column, length=unit, mode=2, B=V.column)
        return scale_by_gain(of, add_joint_velocities(of, V, unit))


LawLike = Law | str  # a law, or its name
LAW = KindOf(LAWS, default="joint", beside_of={"length": ("camera", "length")}, protocol=Law)
