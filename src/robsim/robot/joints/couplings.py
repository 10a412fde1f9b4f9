"""Base class of couplings, by which a coordinate depends on others."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from robsim.declare import Text, family
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.stages import CompiledStage

COUPLINGS = family("coupling")
SourceName = Annotated[str, Text(129, least=1), "Name of the coordinate that this one follows."]
CoordinateType = Literal["an angle", "a length"]
UPRIGHT_TOLERANCE = (
    1e-9  # largest deviation of components of a wheel axis from the required direction
)


class Coupling:
    """Base class of all couplings, by which a coordinate depends on others."""

    stage: ClassVar[CompiledStage | None] = None  # stage that computes the coordinate
    tied: ClassVar[bool] = True  # whether the coordinate is a function of others, not a state
    limited: ClassVar[bool] = True  # whether limits of the coordinate are checked
    on_a_car: ClassVar[bool] = False  # whether it needs its position on a car
    on_a_curve: ClassVar[bool] = False  # whether it needs the curve of its rail
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

    def fits(self, source: Any, steers: bool) -> bool:
        """Return whether a joint can be the source; `steers` if its steering angle is."""
        return False

    def add_stages(self, placed: Any, which: int, **rows: BlockRows) -> None:
        """Add the stage that computes the coordinate; `which` is the number of its curve."""
        placed.program.add(self.stage, **rows)
