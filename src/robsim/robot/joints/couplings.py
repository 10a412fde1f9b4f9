"""The base of all ways in which a coordinate depends on others."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from robsim.declare import Text, family
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.stages import CompiledStage

COUPLINGS = family("coupling")
SourceName = Annotated[str, Text(129, least=1), "Name of the coordinate that this one follows."]
CoordinateType = Literal["an angle", "a length"]
UPRIGHT_TOLERANCE = 1e-9  # how far the axis of a wheel may point from where it should


class Coupling:
    """The base class of all ways in which a coordinate follows another."""

    stage: ClassVar[CompiledStage | None] = None  # that computes the coordinate
    tied: ClassVar[bool] = True  # whether the coordinate is not a state of its own
    limited: ClassVar[bool] = True  # whether limits of the coordinate are checked
    on_a_car: ClassVar[bool] = False  # whether it needs its position on a car
    on_a_curve: ClassVar[bool] = False  # whether it needs the curve of its rail
    wanted: ClassVar[str] = "one coordinate of one joint, or a steering angle"
    of: str

    @property
    def yields(self) -> CoordinateType | None:
        """The kind of coordinate that it gives: an angle, a length, or None for either."""
        return None

    @property
    def relation(self) -> str:
        """The coupling in a few words, for overviews."""
        return ""

    @property
    def constants(self) -> tuple[float, float, float]:
        """The constants of its stage, but for what is on a car: wheelbase, and x and y on it."""
        return 0.0, 0.0, 0.0

    def fits(self, source: Any, steers: bool) -> bool:
        """Return whether the source, a joint, is a suitable one; `steers`: by a steering angle."""
        return False

    def add_stages(self, placed: Any, which: int, **rows: BlockRows) -> None:
        """Add the stage of the coordinate to what is placed; `which` numbers the curve it is on."""
        placed.program.add(self.stage, **rows)
