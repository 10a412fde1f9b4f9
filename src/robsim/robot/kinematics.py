"""The kinematics of a robot: forward and inverse kinematics, Jacobian, exact motion."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

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
from robsim.geometry.pose import broadcast_leading_shape
from robsim.robot.frame_evaluator import FrameEvaluator
from robsim.robot.ik.arm import IKArm
from robsim.robot.ik.closed_form import ClosedFormIK, solve_closed
from robsim.robot.ik.ik_result import IKResult
from robsim.robot.ik.ik_search import SearchBudget
from robsim.robot.ik.numeric_ik import solve_numeric
from robsim.robot.robot_coordinates import RobotCoordinates


class Kinematics(RobotCoordinates):
    """The motion of a `Robot`."""

    home: Any
    tip: str

    def fk(self, q: Any, link: str | None = None) -> Array:
        """Return the pose (..., 4, 4) of a link (the tip by default) in the base link's frame.

        >>> from robsim import Robot
        >>> Robot.from_dh([[0, 0, 1, 0]]).fk([np.pi / 2]).round(9)[:3, 3]
        array([0., 1., 0.])
        """
        return self._evaluated(self._placement(link).poses, q, (4, 4))

    def frames(self, q: Any) -> Array:
        """Return poses (..., links, 4, 4) of all links, the base first, in the base link's frame.

        >>> from robsim import Robot
        >>> Robot.from_dh([[0, 0, 1, 0]] * 2).frames([0.0, 0.0])[:, 0, 3]
        array([0., 1., 2.])
        """
        return self._evaluated(self._every_frame.poses, q, (len(self.links), 4, 4))

    def jacobian(self, q: Any, link: str | None = None) -> Array:
        """Return the geometric Jacobian (..., 6, nv) of a link's origin, (v, omega) in base axes.

        >>> from robsim import Robot
        >>> Robot.from_dh([[0, 0, 1, 0]]).jacobian([0.0])[:, 0]
        array([0., 1., 0., 0., 0., 1.])
        """
        return self._evaluated(self._placement(link).jacobian, q, (6, self.tree.nv))

    def _evaluated(
        self, fill: Callable[[Array, Array], bool], q: Any, shape: tuple[int, ...]
    ) -> Array:
        """Return an array (..., *shape) that `fill` computes of q (..., nq), once it is checked.

        What is usual is checked on the way, by the kernel, and the rest afterwards: looking at one
        configuration in Python takes longer than placing it.
        """
        plain, nq = self._is_plain, self.tree.nq
        if not plain:
            values = self.coordinates(q, limits=False)
        else:
            values = q if is_kernel_array(q, nq) else as_floats(q, "q", (nq,))
        out = np.empty(values.shape[:-1] + shape)
        if not fill(values, out) and plain:
            self.coordinates(values, limits=False)
        return out

    def ik(
        self,
        T: Any,
        q0: Any = None,
        *,
        link: str | None = None,
        mask: Any = None,
        tolerance: float = 1e-8,
        iterations: int = 40,
        restarts: int = 100,
        seed: int = 0,
        limits: bool = True,
        threads: int | None = None,
    ) -> IKResult:
        """Return coordinates that bring a link (or the tip) to poses T (..., 4, 4) in the base.

        q0          (..., nq), where the search begins; None is home
        mask        what counts: None for the whole pose, "position", "pointing" (position and the
                    direction of the link's z axis), or six weights of (p_goal - p, rotation vector
                    of R_goal R'), in the axes of the base: each 0 or from a thousandth of the
                    largest on
        tolerance   of `error`, the larger of the metres and the radians that count
        iterations  of each search at most; it ends sooner where it is not worth going on. The last
                    one goes on from the best that was found, ten times as long if it has to
        restarts    how many more searches, from random coordinates, nearest pose first
        seed        of these; they are the same for every row
        limits      False to search without them
        threads     how many; None for one per processor. The result is the same for any number

        Damped least squares with a damping in proportion to the squared error (Chan and Lawrence
        1988; Sugihara 2011); joints at their limits are held there. What moves freely may take
        part, a vehicle not. A row has the same bits alone and in any batch. InputError: T is no
        pose, q0 does not fit, no joint moves the link, it rides on a vehicle.

        >>> from robsim import Pose, Robot
        >>> arm = Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]], home=[0.1, 0.1])
        >>> found = arm.ik(Pose.at(1, 1, 0), mask="position")
        >>> bool(found.success), found.reason.name
        (True, 'SOLVED')
        """
        arm = self._arm(link, limits)
        start = self.home if q0 is None else self.coordinates(q0, "q0", limits=limits)
        effort = SearchBudget.checked(tolerance, iterations, restarts, seed, threads)
        return solve_numeric(arm, T, start, mask, effort)

    def closed_ik(
        self, T: Any, *, link: str | None = None, tolerance: float = 1e-9
    ) -> ClosedFormIK:
        """Return all solutions for poses T (..., 4, 4), if the arm has a closed form.

        Six joints with a spherical wrist have eight (Pieper 1968; Paul and Zhang 1986), five like
        those of the Rhino four (Schilling 1990, section 3.5); axes 2 and 3 are parallel, and axis
        1 is square to them. The arm is known by its geometry, not by its name. A solution is valid
        if the entries of its pose differ from T by no more than the tolerance. InputError: T is no
        pose, or the arm has no such form, and why.

        >>> from robsim import Robot
        >>> a = np.pi / 2
        >>> rows = [[0, 0.3, 0, -a], [0, 0, 0.2, 0], [0, 0, 0.2, 0], [0, 0, 0, -a], [0, 0.1, 0, 0]]
        >>> arm = Robot.from_dh(rows)
        >>> found = arm.closed_ik(arm.fk([0.1, -1.0, 1.0, 0.5, 0.2]))
        >>> found.q.shape, found.q[0].round(9)
        ((4, 5), array([ 0.1, -1. ,  1. ,  0.5,  0.2]))
        """
        return solve_closed(self._arm(link, True), T, tolerance)

    def _arm(self, link: str | None, limits: bool) -> IKArm:
        """Return the problem of inverse kinematics for a link of this robot, computed once."""
        key = self._link(link), as_bool(limits, "limits")
        if key not in self._arms:
            rows = self._ranges if limits else np.tile([-np.inf, np.inf], (self.nq, 1))
            names = self.coordinate_units, self.velocity_names
            self._arms[key] = IKArm(self.tree, key[0], rows, self.home, *names)
        return self._arms[key]

    @cached_property
    def _arms(self) -> dict[tuple[str, bool], IKArm]:
        """What `_arm` has returned, by link and whether there are limits."""
        return {}

    def integrate(self, q: Any, v: ArrayLike, dt: float) -> Array:
        """Return coordinates (..., nq) after velocity v (..., nv) was held for dt seconds, exactly.

        A floating joint moves by T exp(V dt), a planar one or a unicycle along an arc, a car too,
        once it has steered; limits of coordinates are not looked at.

        >>> from robsim import Robot
        >>> Robot.from_dh([[0, 0, 1, 0]]).integrate([0.1], [2.0], 0.5)
        array([1.1])
        """
        start, rate = self.coordinates(q, limits=False), as_floats(v, "v", (self.nv,))
        lead = broadcast_leading_shape(start.shape[:-1], rate.shape[:-1], "q and v")
        moved = move_runs_last(np.broadcast_to(start, (*lead, self.nq)), 1).copy()
        rates = move_runs_last(np.broadcast_to(rate, (*lead, self.nv)), 1)
        self.tree.advance(moved, rates, as_float(dt, "dt"))
        if not np.isfinite(moved).all():
            raise InputError("q, v and dt: too large, so that where they lead is not finite")
        return move_runs_first(moved, lead)

    def _link(self, name: str | None) -> str:
        if name is None:
            return self.tip
        names = [link.name for link in self.links]
        if not is_known_name(name, names):
            raise FrameError(
                f"no frame {format_value(name)} in robot '{self.name}'; {suggest_names(name, names, 'frames')}"
            )
        return name

    def _placement(self, link: str | None) -> FrameEvaluator:
        """Return the link as the kernels know it, or the tip for None."""
        found = self._placements.get(link) if link is None or isinstance(link, str) else None
        if found is None:
            found = self._placements[link] = FrameEvaluator(self.tree, [self._link(link)])
        return found

    @cached_property
    def _placements(self) -> dict[str | None, FrameEvaluator]:
        """What `_placement` has returned, by link."""
        return {}

    @cached_property
    def _every_frame(self) -> FrameEvaluator:
        """All links, in their order."""
        return FrameEvaluator(self.tree, [link.name for link in self.links])

    @cached_property
    def _is_plain(self) -> bool:
        """Whether coordinates are used as they are given, and a kernel can look at them."""
        return self.tree.compiled and not self._checked and not self._floats
