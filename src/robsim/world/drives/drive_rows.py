"""The state of driven joints, and the program rows that a drive reads and writes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, view_for_user, view_runs_first
from robsim.base.errors import InputError
from robsim.kernels.dynamics.joint_drives import limit_torques
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.world.drives.believed_dynamics import BelievedDynamics
from robsim.world.imperfections.image_effect import check_effect_result

PERIOD_SLACK = 1e-6  # relative error of a time that is a whole number of steps


@dataclass(frozen=True, eq=False)
class DriveState:
    """State of the n joints of B runs in a sub-step, for a user's drive.

    Attributes
    ----------
    seconds : float
        Time at the start of the control period, the same for all of its sub-steps.
    command : ndarray of shape (B, n)
        Velocities that the controller commands, in rad/s or m/s; torques of a law that commands
        torques.
    v, q : ndarray of shape (B, n)
        True velocities and coordinates of the joints.
    gap : ndarray of shape (B, n)
        Integral of the command, minus the motion of the joint since the start, in rad or m. It has
        no meaning if the command is a torque.
    gravity : ndarray of shape (B, n)
        Believed gravity load in N m or N.
    runs : ndarray of shape (B,)
        Numbers of the runs.

    Examples
    --------
    A drive with a spring from the integral of the command:

    >>> class Spring:
    ...     def torque(self, state):
    ...         return 50.0 * state.gap - 2.0 * state.v + state.gravity
    >>> joints = np.zeros((1, 2))
    >>> state = DriveState(0.0, joints, joints, joints, joints + 0.1, joints + 4.0, np.arange(1))
    >>> Spring().torque(state)
    array([[9., 9.]])
    """

    seconds: float
    command: Array
    v: Array
    q: Array
    gap: Array
    gravity: Array
    runs: NDArray[np.int64]


@dataclass
class DriveRows:
    """Program rows of the n driven joints of a scene.

    Attributes
    ----------
    program : Program
        Stages of a control period. A drive stores its state in new rows of the program.
    names : tuple of str
        Names of the joints.
    seconds : float
        Control period.
    parts : int
        Number of sub-steps in a control period.
    h : BlockRows
        Length of a sub-step in seconds.
    command : BlockRows of shape (n,)
        Commanded velocities, or commanded torques.
    v, q, gap : BlockRows of shape (n,)
        Velocities, coordinates, and integral of the command minus the motion.
    torque : BlockRows of shape (n,)
        Torques of the drives, written by the drive and then limited.
    slope : BlockRows of shape (n,)
        Derivative of -torque by v, integrated implicitly; 0 for a torque that is held.
    saturation : BlockRows of shape (n,)
        Share of the control period in which the torque was limited.
    limits, damping, friction : BlockRows of shape (n,)
        Largest torques, infinite without a limit, and the friction of the joints.
    share : BlockRows
        Share of a sub-step in the control period.
    inertia : Array of shape (n,) or (n, runs)
        Diagonal of the believed mass matrix at home, with the armature.
    load : Array of shape (n, runs)
        Torques that hold the joints at the start.
    fed : Array of shape (n, runs)
        Believed gravity load at the start.
    believed : BelievedDynamics
        Model of the drive.

    Examples
    --------
    The method `bind` of a drive that is compiled. It holds the believed weight alone:

    >>> def bind(self, rows, runs):
    ...     def add():
    ...         rows.believed.add_gravity(rows.torque)
    ...         rows.limit(rows.share)
    ...     return add
    """

    program: Program
    names: tuple[str, ...]
    seconds: float
    parts: int
    h: BlockRows
    command: BlockRows
    v: BlockRows
    q: BlockRows
    gap: BlockRows
    torque: BlockRows
    slope: BlockRows
    saturation: BlockRows
    limits: BlockRows
    damping: BlockRows
    friction: BlockRows
    share: BlockRows
    inertia: Array
    load: Array
    fed: Array
    believed: BelievedDynamics

    @property
    def n(self) -> int:
        """Number of driven joints."""
        return len(self.names)

    def limit(self, share: BlockRows) -> None:
        """Add the stage that limits torques, which hold for a share of the control period."""
        rows = {"torque": self.torque, "slope": self.slope, "saturation": self.saturation}
        self.program.add(limit_torques, limits=self.limits, share=share, **rows)

    def call(
        self, torque: Callable[[DriveState], Array], name: str, runs: NDArray[np.int64]
    ) -> None:
        """Add a Python function from the state of the joints to torques (B, n)."""
        gravity = self.program.rows(self.n)
        self.believed.add_gravity(gravity)
        self.program.call(partial(self._call_python, torque, name, runs, gravity))

    def _call_python(
        self,
        torque: Callable[[DriveState], Array],
        name: str,
        runs: NDArray[np.int64],
        gravity: BlockRows,
        blocks: Blocks,
        step: int,
    ) -> None:
        """Call a user's drive and store its torques."""
        names = self.command, self.v, self.q, self.gap, gravity
        command, v, q, gap, load = (view_for_user(blocks.get(rows)) for rows in names)
        seconds = (step - 1) * self.seconds
        state = DriveState(seconds, command, v, q, gap, load, runs[blocks.rows])
        shape = view_runs_first(blocks.get(self.torque))
        blocks.put(self.torque, check_effect_result(shape, torque(state), f"{name}.torque").T)


def count_whole_steps(seconds: float, step: float) -> int:
    """Return the number of steps in a time, or 0 if it is not a whole number above 0."""
    count = round(seconds / step)
    return count if abs(count * step - seconds) <= PERIOD_SLACK * seconds else 0


def spread_over_joints(values: ArrayLike, what: str, names: Sequence[str]) -> Array:
    """Return one number for each joint; InputError for a list of another length."""
    array = np.asarray(values, dtype=np.float64)
    if array.shape not in ((), (len(names),)):
        each = ", ".join(names)
        raise InputError(f"{what}: {array.size} numbers for {len(names)} driven joints: {each}")
    return np.array(np.broadcast_to(array, (len(names),)))
