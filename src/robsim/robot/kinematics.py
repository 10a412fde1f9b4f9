"""Kinematics of a robot: forward and inverse kinematics, Jacobian, exact motion."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import (
    Array,
    as_bool,
    as_float,
    as_floats,
    is_kernel_array,
    move_runs_first,
    move_runs_last,
)
from robsim.base.errors import FrameError, InputError, format_value, is_known_name, suggest_names
from robsim.geometry.pose import PoseLike, broadcast_leading_shape
from robsim.robot.frame_evaluator import FrameEvaluator
from robsim.robot.ik.arm import IKArm
from robsim.robot.ik.closed_form import ClosedFormIK, solve_closed
from robsim.robot.ik.ik_result import IKResult
from robsim.robot.ik.ik_search import SearchBudget
from robsim.robot.ik.numeric_ik import IKMask, solve_numeric
from robsim.robot.robot_coordinates import Coordinates, RobotCoordinates


class Kinematics(RobotCoordinates):
    """Forward and inverse kinematics of a `Robot`, its Jacobian, and its motion."""

    home: Array
    tip: str

    def fk(self, q: Coordinates, link: str | None = None) -> Array:
        """Return the pose of a link in the frame of the base link (forward kinematics).

        Parameters
        ----------
        q : array_like of shape (..., nq)
            Coordinates in rad and m. Their limits are not checked.
        link : str, optional
            Name of the link. Default: the tip.

        Returns
        -------
        ndarray of shape (..., 4, 4)
            Homogeneous matrices T_base_link, in metres.

        Examples
        --------
        >>> from robsim import Robot
        >>> Robot.from_dh([[0, 0, 1, 0]]).fk([np.pi / 2]).round(9)[:3, 3]
        array([0., 1., 0.])
        """
        return self._evaluate(self._placement(link).poses, q, (4, 4))

    def frames(self, q: Coordinates) -> Array:
        """Return the poses of all links in the frame of the base link.

        Parameters
        ----------
        q : array_like of shape (..., nq)
            Coordinates in rad and m. Their limits are not checked.

        Returns
        -------
        ndarray of shape (..., links, 4, 4)
            Homogeneous matrices, the base first, in metres.

        Examples
        --------
        >>> from robsim import Robot
        >>> Robot.from_dh([[0, 0, 1, 0]] * 2).frames([0.0, 0.0])[:, 0, 3]
        array([0., 1., 2.])
        """
        return self._evaluate(self._every_frame.poses, q, (len(self.links), 4, 4))

    def jacobian(self, q: Coordinates, link: str | None = None) -> Array:
        """Return the geometric Jacobian of a link.

        The Jacobian J maps velocities to the twist of the link, (v, omega) = J(q) qdot, with the
        velocity v of the origin of the link and the angular velocity omega in the axes of the base
        link.

        Parameters
        ----------
        q : array_like of shape (..., nq)
            Coordinates in rad and m. Their limits are not checked.
        link : str, optional
            Name of the link. Default: the tip.

        Returns
        -------
        ndarray of shape (..., 6, nv)
            Rows v (m/s) and omega (rad/s) for a unit of each velocity.

        Examples
        --------
        >>> from robsim import Robot
        >>> Robot.from_dh([[0, 0, 1, 0]]).jacobian([0.0])[:, 0]
        array([0., 1., 0., 0., 0., 1.])
        """
        return self._evaluate(self._placement(link).jacobian, q, (6, self.tree.nv))

    def _evaluate(
        self, fill: Callable[[Array, Array], bool], q: Coordinates, shape: tuple[int, ...]
    ) -> Array:
        """Return an array (..., *shape) that `fill` computes from q (..., nq).

        The kernel checks coordinates while it evaluates them, since a check in Python takes longer
        than the evaluation of one configuration. If this check fails, `coordinates` raises the
        error.
        """
        is_plain, nq = self._is_plain, self.tree.nq
        if not is_plain:
            values = self.coordinates(q, limits=False)
        else:
            values = q if is_kernel_array(q, nq) else as_floats(q, "q", (nq,))  # type: ignore[assignment, arg-type]
        out = np.empty(values.shape[:-1] + shape)
        if not fill(values, out) and is_plain:
            self.coordinates(values, limits=False)
        return out

    def ik(
        self,
        T: PoseLike,
        q0: Coordinates | None = None,
        *,
        link: str | None = None,
        mask: IKMask | None = None,
        tolerance: float = 1e-8,
        iterations: int = 40,
        restarts: int = 100,
        seed: int = 0,
        limits: bool = True,
        threads: int | None = None,
    ) -> IKResult:
        """Return coordinates that bring a link to a pose (numerical inverse kinematics).

        The search repeats damped least-squares steps

            dq = (J' J + mu 1)^-1 J' e,

        with the weighted pose error e, the weighted Jacobian J, and a damping mu that is
        proportional to e'e (Chan and Lawrence 1988; Sugihara 2011). A joint at a limit is held
        there while the step would leave the limits. If the first search fails, further searches
        start from random coordinates. Floating and planar joints can move the link; vehicles
        cannot. Each row of a batch has the same bits as a single call.

        Parameters
        ----------
        T : Pose or array_like of shape (..., 4, 4)
            Goal poses of the link in the frame of the base link.
        q0 : array_like of shape (..., nq), optional
            Start of the first search, in rad and m. Default: home.
        link : str, optional
            Name of the link. Default: the tip.
        mask : {"pose", "position", "pointing"} or array_like of shape (6,), optional
            Parts of the pose that count. "pointing" selects the position and the direction of the z
            axis of the link. Six weights multiply the position error p_goal - p and the rotation
            vector of R_goal R', in axes of the base; each weight is 0 or at least a thousandth of
            the largest. Default: the whole pose.
        tolerance : float, default 1e-8
            Largest `error` of a solution: the larger of the position error in m and the angle in
            rad.
        iterations : int, default 40
            Largest number of iterations of a search. A search without progress ends sooner. After
            all searches, a last search continues from the best coordinates, for up to ten times as
            many iterations.
        restarts : int, default 100
            Largest number of further searches from random coordinates. Coordinates with poses near
            the goal come first.
        seed : int, default 0
            Seed of the random coordinates, which are the same for all rows.
        limits : bool, default True
            Whether to respect the limits of the coordinates.
        threads : int, optional
            Number of threads. Default: one per processor. It does not affect the result.

        Returns
        -------
        IKResult
            Coordinates, success, error, counts and reasons.

        Raises
        ------
        InputError
            If T is not a pose, q0 does not fit, no joint moves the link, or a vehicle carries the
            link.

        See Also
        --------
        closed_ik : All solutions in closed form, for arms that have one.

        References
        ----------
        S. K. Chan and P. D. Lawrence, General inverse kinematics with the error damped
        pseudoinverse, IEEE Int. Conf. on Robotics and Automation, 1988.

        T. Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method,
        IEEE Trans. on Robotics 27(5), 2011.

        Examples
        --------
        >>> from robsim import Pose, Robot
        >>> arm = Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]], home=[0.1, 0.1])
        >>> result = arm.ik(Pose.at(1, 1, 0), mask="position")
        >>> bool(result.success), result.reason.name
        (True, 'SOLVED')
        """
        arm = self._arm(link, limits)
        start = self.home if q0 is None else self.coordinates(q0, "q0", limits=limits)
        effort = SearchBudget.checked(tolerance, iterations, restarts, seed, threads)
        return solve_numeric(arm, T, start, mask, effort)

    def closed_ik(
        self, T: PoseLike, *, link: str | None = None, tolerance: float = 1e-9
    ) -> ClosedFormIK:
        """Return all coordinates that bring a link to a pose, for arms with a closed form.

        An arm with six revolute joints and a spherical wrist has eight solutions (Pieper 1968; Paul
        and Zhang 1986), and an arm with five joints like the Rhino has four (Schilling 1990,
        section 3.5). In both, axis 1 is perpendicular to axis 2, and axis 3 is parallel to axis 2.
        The method derives the geometry from the constants of the joints.

        Parameters
        ----------
        T : Pose or array_like of shape (..., 4, 4)
            Goal poses of the link in the frame of the base link.
        link : str, optional
            Name of the link. Default: the tip.
        tolerance : float, default 1e-9
            Largest difference between entries of T and of the pose of a valid solution.

        Returns
        -------
        ClosedFormIK
            All solutions, with flags for existing solutions and solutions within the limits.

        Raises
        ------
        InputError
            If T is not a pose, or the arm has no such closed form. The message gives the reason.

        References
        ----------
        D. L. Pieper, The kinematics of manipulators under computer control, 1968.

        R. P. Paul and H. Zhang, Computationally efficient kinematics for manipulators with
        spherical wrists, Int. J. Robotics Research 5(2), 1986.

        R. J. Schilling, Fundamentals of Robotics, 1990.

        Examples
        --------
        >>> from robsim import Robot
        >>> a = np.pi / 2
        >>> rows = [[0, 0.3, 0, -a], [0, 0, 0.2, 0], [0, 0, 0.2, 0], [0, 0, 0, -a], [0, 0.1, 0, 0]]
        >>> arm = Robot.from_dh(rows)
        >>> result = arm.closed_ik(arm.fk([0.1, -1.0, 1.0, 0.5, 0.2]))
        >>> result.q.shape, result.q[0].round(9)
        ((4, 5), array([ 0.1, -1. ,  1. ,  0.5,  0.2]))
        """
        return solve_closed(self._arm(link, True), T, tolerance)

    def _arm(self, link: str | None, limits: bool) -> IKArm:
        """Return the inverse kinematics problem of a link of this robot, computed once."""
        key = self._link(link), as_bool(limits, "limits")
        if key not in self._arms:
            rows = self._ranges if limits else np.tile([-np.inf, np.inf], (self.nq, 1))
            names = self.coordinate_units, self.velocity_names
            self._arms[key] = IKArm(self.tree, key[0], rows, self.home, *names)
        return self._arms[key]

    @cached_property
    def _arms(self) -> dict[tuple[str, bool], IKArm]:
        """Cache of `_arm`, by link and use of limits."""
        return {}

    def integrate(self, q: Coordinates, v: ArrayLike, dt: float) -> Array:
        """Return the coordinates after a constant velocity over a time, exactly.

        A floating joint moves by T exp(V dt), and a planar joint or unicycle along an arc. A car
        first steers, within its limits, and then moves along an arc. Limits of other coordinates
        are not applied.

        Parameters
        ----------
        q : array_like of shape (..., nq)
            Coordinates at the start, in rad and m.
        v : array_like of shape (..., nv)
            Velocities, in rad/s and m/s.
        dt : float
            Time in seconds.

        Returns
        -------
        ndarray of shape (..., nq)
            Coordinates at the end.

        Raises
        ------
        InputError
            If the shapes do not fit, or the result is not finite.

        Examples
        --------
        >>> from robsim import Robot
        >>> Robot.from_dh([[0, 0, 1, 0]]).integrate([0.1], [2.0], 0.5)
        array([1.1])
        """
        start, rate = self.coordinates(q, limits=False), as_floats(v, "v", (self.nv,))
        lead = broadcast_leading_shape(start.shape[:-1], rate.shape[:-1], "q and v")
        coordinates = move_runs_last(np.broadcast_to(start, (*lead, self.nq)), 1).copy()
        rates = move_runs_last(np.broadcast_to(rate, (*lead, self.nv)), 1)
        self.tree.advance(coordinates, rates, as_float(dt, "dt"))
        if not np.isfinite(coordinates).all():
            raise InputError("q, v and dt: too large, so that the result is not finite")
        return move_runs_first(coordinates, lead)

    def _link(self, name: str | None) -> str:
        """Return the name of a link, or of the tip for None; raise FrameError if no link has it."""
        if name is None:
            return self.tip
        names = [link.name for link in self.links]
        if not is_known_name(name, names):
            hint = suggest_names(name, names, "frames")
            raise FrameError(f"no frame {format_value(name)} in robot '{self.name}'; {hint}")
        return name

    def _placement(self, link: str | None) -> FrameEvaluator:
        """Return the compiled evaluation of a link, or of the tip for None."""
        evaluator = self._placements.get(link) if link is None or isinstance(link, str) else None
        if evaluator is None:
            evaluator = FrameEvaluator(self.tree, [self._link(link)])
            self._placements[link] = evaluator
        return evaluator

    @cached_property
    def _placements(self) -> dict[str | None, FrameEvaluator]:
        """Cache of `_placement`, by link."""
        return {}

    @cached_property
    def _every_frame(self) -> FrameEvaluator:
        """Compiled evaluation of all links, in their order."""
        return FrameEvaluator(self.tree, [link.name for link in self.links])

    @cached_property
    def _is_plain(self) -> bool:
        """Whether coordinates need no conversion, so that a kernel can check them."""
        return self.tree.compiled and not self._kind_checks and not self._is_floating
