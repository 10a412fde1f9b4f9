"""Limits that every command of an experiment respects, independent of its task."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from robsim.base.arrays import Array
from robsim.base.errors import FrameError, InputError, prefix_errors
from robsim.declare import DeclaredValue, Flag, Role, Table, Time, Word, described
from robsim.declare.joint_numbers import (
    OneOrEach,
    broadcast_limits,
    check_joint_count,
    get_coordinate_axes,
    get_velocity_axes,
)
from robsim.declare.scalars import NOT_NEGATIVE
from robsim.servo.constraints.joint_limits import check_margin_room
from robsim.world.frame_box import FrameBox
from robsim.world.scene import Scene

LimitValue = float | Sequence[float]  # one number for all joints, or one for each


@described
@dataclass(frozen=True)
class Fence(FrameBox):
    """Box in the world that the origin of a frame must not leave.

    The guard predicts the frame along the braking motion of the joints, at six poses up to rest,
    and brakes before the frame leaves the box. It bounds the path between the poses by the control
    points of the polynomial through them. If the joints move by at most 4 rad together until they
    rest, the frame leaves the box by less than 0.1 mm.

    This holds while calls of the controller are at most `Safety.call_interval` apart. A later call
    brakes, and the frame leaves the box by at most its own motion in the time by which commands
    acted too long. Outside the box, motions that lead farther out are not commanded. Joints of a
    user's own kind count as standing still.

    Raises
    ------
    InputError
        By `simulate`, if the frame does not exist, or if no joint moves it.

    Examples
    --------
    The tip of an arm is to move to x = 0.4 m, and stops at the fence:

    >>> import robsim as rs
    >>> arm = rs.robots.ur5e()
    >>> fence = Fence(f"ur5e.{arm.tip}", low=(0.5, -1, 0), high=(1, 1, 1))
    >>> task = rs.FollowPath([0.4, -0.2, 0.5], mask="position", duration=2.0)
    >>> safety = Safety(acceleration=10.0, fence=fence)
    >>> run = rs.simulate(rs.Scene([arm]), task, duration=4.0, safety=safety)
    >>> f"{float(run.frame_pose[:, 0, 3].min()):.2f} m"
    '0.50 m'
    """


@described
@dataclass(frozen=True)
class Watchdog(DeclaredValue):
    """Reaction to missing images: brake, then resume or stay at rest.

    The robot brakes once the last image is older than `after`. With then="hold" it resumes at the
    next image; with then="stop" it stays at rest until a reset of the controller. A short `after`
    also stops the robot between the images of a slow camera.

    Examples
    --------
    An image comes every 0.6 s, and the robot stops after 0.2 s of each period:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> settings = {"duration": 60, "sensing": rs.Sensing(period=0.6)}
    >>> for watchdog in None, Watchdog(after=0.2):
    ...     safety = Safety(acceleration=5.0, watchdog=watchdog)
    ...     run = rs.simulate(
    ...         scenario.scene, scenario.task, scenario.start, safety=safety, **settings
    ...     )
    ...     print(f"{float(run.end_time):.1f} s")
    17.4 s
    48.6 s
    """

    after: Annotated[
        float, Time(above=0), "Age of the last image beyond which the robot brakes, in seconds."
    ]
    then: Annotated[
        str,
        Word(("hold", "stop")),
        "Reaction to the next image: resume (hold), or stay until a reset (stop).",
    ] = "hold"


@described
@dataclass(frozen=True)
class Safety(DeclaredValue):
    """Limits of all commands, in a simulation and on a real robot (`Controller`).

    The limits act in this order:

    1. A robot that is held or stopped (`watchdog`, `hold_to_run`) brakes as fast as `acceleration`
       allows. `ramp` makes the command grow from zero at the start and after every hold.
    2. `speed` scales the whole command and keeps its direction.
    3. `acceleration` bounds the change of each velocity.
    4. Each joint is slow enough to brake at a distance `margin` in front of its limit.
    5. The whole motion is slow enough for the frame of `fence` to brake inside its box.

    Limits 3 and 4 are the bounds of quadratic programs with the task Jacobian A: the command
    minimises ||A (qdot - wish)||^2 within them, so that the other joints keep the error on its path
    if one joint is held back. A command that its accelerations cannot reach is slowed rather than
    deflected. A command within all limits is not changed, bit for bit.

    A safe state stays safe, since limits 4 and 5 need no braking beyond `acceleration`. If a
    command acts longer than planned, `acceleration` still holds, and limits 4 and 5 may be
    exceeded. Without `acceleration` a velocity can change at once.

    Each command of a `Controller` acts until the next period begins: for `dt` if each call is on
    time, and for less than `dt` + `call_interval` in general. Limits 4 and 5 plan for this time.

    Limits are one number for all velocities or coordinates of the scene, or one number for each;
    numbers of joints that the task does not command are ignored. Joints that lag behind their
    commands need some margin.

    Raises
    ------
    InputError
        By `simulate`, if the number of limits is wrong, if a margin leaves a joint no range, or if
        no joint moves the frame of `fence`.

    Examples
    --------
    >>> import robsim as rs
    >>> from dataclasses import replace
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
    >>> safe = replace(scenario, safety=Safety(speed=0.2))
    >>> for experiment in scenario, safe:
    ...     print(round(float(abs(experiment.run().qd).max()), 2))
    0.52
    0.2
    """

    speed: Annotated[
        LimitValue | None,
        OneOrEach(get_velocity_axes, "/s"),
        "Limit of |qdot|, which scales the whole command; None: no limit.",
    ] = None
    acceleration: Annotated[
        LimitValue | None,
        OneOrEach(get_velocity_axes, "/s^2"),
        "Limit of the change of each velocity per second, also when braking; None: no limit.",
    ] = None
    margin: Annotated[
        LimitValue | None,
        OneOrEach(get_coordinate_axes, item=NOT_NEGATIVE),
        "Distance that joints keep from their limits; None: limits are ignored.",
    ] = None
    fence: Annotated[Fence | None, Table(Fence), "Box that a frame must not leave."] = None
    watchdog: Annotated[
        Watchdog | None, Table(Watchdog), "Reaction to missing images; None: no reaction."
    ] = None
    ramp: Annotated[
        float | None, Time(above=0), "Time in which a command grows from zero to its full size."
    ] = None
    hold_to_run: Annotated[
        bool,
        Flag(),
        Role.ROBOT,
        "Whether `Controller.step` moves the robot only while its argument `run` is true.",
    ] = False
    driver_holds: Annotated[
        bool,
        Flag(),
        Role.ROBOT,
        "Whether the robot continues its last command while no call comes: after a pause "
        "`Controller.step` then brakes it within `acceleration`. False: it stands still after a "
        "pause.",
    ] = False
    call_interval: Annotated[
        float | None,
        Time(above=0),
        "Longest time between two calls of `Controller.step`, for which `fence` and `margin` plan; "
        "None: each call is on time.",
    ] = None

    def check(self, scene: Scene) -> None:
        """Check that the limits fit a scene.

        Parameters
        ----------
        scene : Scene
            Scene of the experiment.

        Raises
        ------
        InputError
            If the number of limits differs from the number of velocities or coordinates, if a
            margin leaves a joint no range, or if no joint moves the frame of `fence`.
        """
        for name, owners in (
            ("speed", scene.velocity_names),
            ("acceleration", scene.velocity_names),
            ("margin", scene.coordinate_names),
        ):
            check_joint_count(getattr(self, name), name, owners)
        self.check_margin(scene)
        if self.fence is not None:
            self._check_fence(self.fence, scene)

    def check_margin(self, scene: Scene) -> None:
        """Raise InputError unless the margins leave joints some range between their limits."""
        if self.margin is None:
            return
        check_margin_room(self.limits("margin", scene.nq), scene)

    def _check_fence(self, fence: Fence, scene: Scene) -> None:
        """Raise InputError unless the frame exists and a joint moves it."""
        with prefix_errors("fence"):
            try:
                moves = scene.tree.flag_moves(fence.frame).any()
            except FrameError as error:
                raise InputError(str(error)) from None
            if not moves:
                raise InputError(f"no joint moves frame '{fence.frame}'")

    def limits(self, which: str, count: int) -> Array:
        """Return one limit for each velocity or coordinate.

        Parameters
        ----------
        which : {"speed", "acceleration", "margin"}
            Name of the limit.
        count : int
            Number of velocities or coordinates.

        Returns
        -------
        ndarray of shape (count,)
            Limits; infinity without a limit.
        """
        return broadcast_limits(getattr(self, which), count)


SAFETY_TABLE = Table(Safety)
