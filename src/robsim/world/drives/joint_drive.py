"""The base class of drives, and their model of the joints."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.declare import DeclaredValue, Flag, KindOf, Number, PerRun, Table, described, family
from robsim.declare.array_types import Numbers
from robsim.declare.scalars import POSITIVE

if TYPE_CHECKING:  # the stages are imported only if there is a drive
    from robsim.world.drives.drive_rows import DriveRows, DriveState

DRIVES = family("drive")
VELOCITY, TORQUE = "velocity", "torque"  # the quantities that a law commands
Share = Number(least=0)
FASTEST_LOOP = 1e6  # 1/s; loops of currents are slower


@described
@dataclass(frozen=True)
class DriveModel(DeclaredValue):
    """Model of the joints that a drive believes, relative to the true joints.

    A number of 1 is the truth, and 0.8 is 20 % below the truth.

    Examples
    --------
    A model with links of 80 % of their mass, and without the payload:

    >>> import robsim as rs
    >>> rs.drives.VelocityLoop(model=DriveModel(mass=0.8)).model.payload
    False
    """

    mass: Annotated[
        float, Share, PerRun(()), "Believed masses and inertias of all links, as a share."
    ] = 1.0
    gravity: Annotated[
        float, Share, PerRun(()), "Believed acceleration of gravity, as a share of the true one."
    ] = 1.0
    friction: Annotated[
        float,
        Share,
        PerRun(()),
        "Share of the friction that is compensated at the commanded velocity.",
    ] = 0.0
    payload: Annotated[
        bool, Flag(), "Whether the model includes the payloads and the objects on the robot."
    ] = False


TRUE_MODEL = DriveModel()


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
    command_quantity : str
        Quantity that the law commands, "velocity" or "torque".

    Examples
    --------
    A compiled drive that adds a constant torque to a velocity loop, by stages of its own:

    >>> import robsim as rs
    >>> from robsim.kernels.dynamics.joint_drives import add_torques
    >>> class Pushed(rs.drives.VelocityLoop):
    ...     def bind(self, rows, runs):
    ...         push, loop = rows.program.constant([5.0]), super().bind(rows, runs)
    ...         def add():
    ...             loop()
    ...             rows.program.add(add_torques, more=push, torque=rows.torque)
    ...         return add
    >>> isinstance(Pushed(), rs.drives.JointDrive)
    True
    """

    command_quantity: ClassVar[str] = VELOCITY
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
        return str(getattr(self.own or self, "command_quantity", VELOCITY))

    def settle(self, inertia: Array, load: Array, fed: Array) -> Array:
        """Return the gaps (n, runs) of the position that hold a load at the start.

        `fed` is the gravity load as the drive believes it.
        """
        return np.zeros_like(load)

    def check(self, names: Sequence[str], seconds: float, parts: int) -> None:
        """Raise InputError if the drive does not fit the joints, or `parts` steps in a period."""

    def count_held_substeps(self, seconds: float, parts: int) -> int:
        """Return the number of sub-steps for which a torque is held, of `parts` in a period."""
        return 1

    def bind(self, rows: DriveRows, runs: NDArray[np.int64]) -> Callable[[], None]:
        """Return a function that adds the stages of the torques in a sub-step."""
        call = getattr(self if self.own is None else self.own, "torque", None)
        if not callable(call):
            raise InputError(
                f"drive {self.label}: expected a method torque(state) or bind(rows, runs), got "
                f"torque = {format_value(call)}"
            )

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
        model = getattr(drive, "model", TRUE_MODEL)
        if not isinstance(model, DriveModel) or np.any(model.friction):
            raise InputError(
                f"{type(drive).__name__}.model: expected a DriveModel without a share of friction, "
                f"got {format_value(model)}"
            )
        made.model, made.torque_limit = model, getattr(drive, "torque_limit", None)
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

        The torques must be a function of the state alone: with images that are taken within a
        period, the sub-steps until then are simulated twice.

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
