"""The base class of drives, and the program rows that they read and write."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, view_for_user, view_runs_first
from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, Flag, KindOf, Number, PerRun, Table, described, family
from robsim.declare.array_types import Numbers
from robsim.declare.scalars import POSITIVE
from robsim.kernels.dynamics.joint_drives import limit_torques
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.world.drives.believed_dynamics import BelievedDynamics
from robsim.world.imperfections.image_effect import check_effect_result

DRIVES = family("drive")
VELOCITY, TORQUE = "velocity", "torque"  # the quantities that a law commands
Share = Number(least=0)


@described
@dataclass(frozen=True)
class DriveModel(DeclaredValue):
    """Model of the joints that a drive believes, relative to the true joints.

    A number of 1 is the truth, and 0.8 is 20 % below the truth.

    Examples
    --------
    A drive that believes links of 80 % of their mass, and does not know the payload:

    >>> import robsim as rs
    >>> rs.drives.VelocityLoop(model=DriveModel(mass=0.8)).model.payload
    False
    """

    mass: Annotated[
        float, Share, PerRun(()), "Believed masses and inertias of all links, as a share."
    ] = 1.0
    gravity: Annotated[
        float, Share, PerRun(()), "Believed acceleration of gravity, as a share of 9.81 m/s^2."
    ] = 1.0
    friction: Annotated[
        float,
        Share,
        PerRun(()),
        "Share of the friction that is compensated at the commanded velocity.",
    ] = 0.0
    payload: Annotated[bool, Flag(), "Whether the drive knows the payloads."] = False


TRUE_MODEL = DriveModel()


@dataclass(frozen=True, eq=False)
class DriveState:
    """State of the n joints of B runs in a sub-step, for a user's drive.

    Attributes
    ----------
    seconds : float
        Time at the start of the control period.
    command : ndarray of shape (B, n)
        Velocities that the controller commands, in rad/s or m/s; torques of a law that commands
        torques.
    v, q : ndarray of shape (B, n)
        True velocities and coordinates of the joints.
    gap : ndarray of shape (B, n)
        Integral of the command, minus the motion of the joint since the start, in rad or m.
    gravity : ndarray of shape (B, n)
        Believed gravity load in N m or N.
    runs : ndarray of shape (B,)
        Numbers of the runs.
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


class JointDrive(DeclaredValue):
    """Base class of drives, which compute the torques of joints.

    A kind is a frozen dataclass of declared fields, registered as a "drive". It adds compiled
    stages (`bind`), or its Python method `torque(state)` is called in every sub-step.

    Attributes
    ----------
    model : DriveModel
        Model of the joints that the drive believes.
    torque_limit : array_like or None
        Largest torques, for all joints or each. None: the effort limits of the joints.
    quantity : str
        Quantity that the law commands, "velocity" or "torque".
    """

    quantity: ClassVar[str] = VELOCITY
    own: object = None
    model: DriveModel
    torque_limit: Any

    @classmethod
    def wrap(cls, drive: object) -> JointDrive:
        """Return a drive with this base class; a user's object is wrapped."""
        return drive if isinstance(drive, JointDrive) else UserDrive.of(drive)

    @property
    def label(self) -> str:
        """The name of the class, for sentences and errors."""
        return type(self.own or self).__name__

    @property
    def commanded(self) -> str:
        """The quantity that the law commands, "velocity" or "torque"."""
        return str(getattr(self.own or self, "quantity", VELOCITY))

    def settle(self, inertia: Array, load: Array, fed: Array) -> Array:
        """Return the gaps (n, runs) of the position that hold a load at the start.

        `fed` is the gravity load as the drive believes it.
        """
        return np.zeros_like(load)

    def count_held_substeps(self, rows: DriveRows) -> int:
        """Return the number of sub-steps for which a torque is held."""
        return 1

    def bind(self, rows: DriveRows, runs: NDArray[np.int64]) -> Callable[[], None]:
        """Return a function that adds the stages of the torques in a sub-step."""
        call = getattr(self if self.own is None else self.own, "torque", None)
        if call is None:
            raise InputError(f"drive {self.label}: expected a method torque(state), or bind(rows)")

        def add() -> None:
            rows.call(call, self.label, runs)
            rows.limit(rows.share)

        return add


class UserDrive(JointDrive):
    """Drive around an object of a user with a method `torque(state)`."""

    model = TRUE_MODEL
    torque_limit = None

    @classmethod
    def of(cls, drive: object) -> UserDrive:
        """Return the drive of a user's object."""
        made = cls()
        made.own = drive
        return made


@runtime_checkable
class OwnDrive(Protocol):
    """The protocol of a user's drive, which needs no base class.

    Register the class with `register("drive", "my_drive")` to use it in scenario files.

    Examples
    --------
    A velocity loop with a gain of 20 N m s/rad, which also holds the believed weight:

    >>> class Proportional:
    ...     def torque(self, state):
    ...         return 20.0 * (state.command - state.v) + state.gravity
    >>> isinstance(Proportional(), OwnDrive)
    True
    """

    def torque(self, state: DriveState) -> Array:
        """Return the torques (B, n) of the joints, in N m or N.

        Parameters
        ----------
        state : DriveState
            State of the joints in a sub-step.

        Returns
        -------
        ndarray of shape (B, n)
            Torques, before their limits.
        """


Model = Annotated[DriveModel, Table(DriveModel), "Model of the joints that the drive believes."]
TorqueLimit = Annotated[
    Array | None,
    Numbers(item=POSITIVE, shape=None),
    "Largest torques in N m or N, one for all joints or one for each. None: the efforts of the "
    "joints.",
]
GravityFed = Annotated[bool, Flag(), "Whether the drive adds the believed gravity load."]
DRIVE = KindOf(DRIVES, none="none", protocol=OwnDrive)


def spread_over_joints(values: ArrayLike, what: str, names: Sequence[str]) -> Array:
    """Return one number for each joint; InputError for a list of another length."""
    array = np.asarray(values, dtype=np.float64)
    if array.shape not in ((), (len(names),)):
        each = ", ".join(names)
        raise InputError(f"{what}: {array.size} numbers for {len(names)} driven joints: {each}")
    return np.array(np.broadcast_to(array, (len(names),)))
