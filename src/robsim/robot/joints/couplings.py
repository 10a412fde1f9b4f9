"""Base class of couplings: coordinates that depend on other coordinates."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Protocol

from robsim.declare import Text, family
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.stages import CompiledStage
from robsim.robot.joints.joint_kind import JointKind, KinematicsRows

COUPLINGS = family("coupling")
SourceName = Annotated[
    str, Text(129, least=1), "Name of the coordinate that this coordinate follows."
]
CoordinateType = Literal["an angle", "a length"]
UPRIGHT_TOLERANCE = 1e-9  # largest deviation in the components of the axis of a wheel


class SourceJoint(Protocol):
    """Properties of a `Joint` that determine whether its coordinate can be a source."""

    @property
    def model(self) -> JointKind:
        """Kind of the joint."""

    @property
    def follows(self) -> Coupling | None:
        """Coupling of the joint, or None."""


class Coupling:
    """Base class of couplings, which make a coordinate depend on another coordinate."""

    stage: ClassVar[CompiledStage | None] = None  # stage that computes the coordinate
    is_coupled: ClassVar[bool] = (
        True  # whether the coordinate is a function of its source, not a state
    )
    limited: ClassVar[bool] = True  # whether limits of the coordinate are checked
    on_a_car: ClassVar[bool] = False  # whether the stage needs the position of the joint on a car
    on_a_curve: ClassVar[bool] = False  # whether the stage needs the curve of a rail
    wanted: ClassVar[str] = "one coordinate of one joint, or a steering angle"
    of: str

    @property
    def yields(self) -> CoordinateType | None:
        """Type of the coordinate: an angle, a length, or None for either."""
        return None

    @property
    def relation(self) -> str:
        """Short description of the coupling, for overviews."""
        return ""

    @property
    def constants(self) -> tuple[float, float, float]:
        """Constants of the stage; a wheel on a car gets the wheelbase and its x and y instead."""
        return 0.0, 0.0, 0.0

    def fits(self, source: SourceJoint, steers: bool) -> bool:
        """Return whether a joint, or its steering angle if `steers`, can be the source."""
        return False

    def add_stages(self, tree: KinematicsRows, which: int, **rows: BlockRows) -> None:
        """Add the stage that computes the coordinate; `which` is the number of its curve."""
        assert self.stage is not None  # a rolling wheel has other stages
        tree.program.add(self.stage, **rows)
