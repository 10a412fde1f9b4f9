"""Occlusions: marks that are hidden for some time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from robsim.base.errors import InputError, suggest_names
from robsim.base.si_units import Dimension
from robsim.declare import Integer, ListOf, PerRun, Quantity, Table, Time, register
from robsim.declare.context import Context, Raw
from robsim.declare.texts import FrameReference
from robsim.kernels.images.mark_occlusion import hide_marks
from robsim.world.imperfections.image_effect import (
    ImageEffect,
    ImageEffectStage,
    ImageRows,
    MarkGroup,
)
from robsim.world.imperfections.imperfection import RunFacts, Statement


@dataclass(frozen=True)
class UnboundedTime(Quantity):
    """The declaration of a time that may be infinite; texts leave out an infinite time."""

    dimension: Dimension = "time"

    def check(self, value: Any, what: str) -> float:
        forever = isinstance(value, float) and value == math.inf
        return math.inf if forever else super().check(value, what)

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        if value != math.inf:
            super().put(table, name, value, c)


HIDDEN_MARKS = ListOf(Integer(0, 10_000), 1, alone=True)


@register("image effect", "occlusion")
@dataclass(frozen=True)
class Occlusion(ImageEffect):
    """Marks that are hidden from `start` until `end`, in seconds.

    `target` and `camera` restrict the occlusion to one object and to one camera. A feature with
    numbers for each mark is servoed on the visible marks. A feature of all marks at once, such as a
    moment or a pose, uses the last position of each hidden mark, and so does any feature without a
    visible mark. If the task has a weighting, the pose is estimated from the visible marks, and the
    run ends if they are too few.

    Examples
    --------
    >>> from robsim import Sensing, examples, load_scenario
    >>> hidden = Occlusion([0], start=0.1, end=0.2)
    >>> case = load_scenario(examples.path("holonomic")).with_(sensing=Sensing(occlusions=hidden))
    >>> float(case.run().end_time) > hidden.end
    True
    """

    place: ClassVar[ImageEffectStage] = ImageEffectStage.HIDDEN
    title: ClassVar[str] = "hidden marks"
    left_out: ClassVar[str] = "occlusions"
    marks: Annotated[tuple[int, ...], HIDDEN_MARKS, "Numbers of the hidden marks."]
    start: Annotated[
        float,
        Time(above=0),
        PerRun(()),
        "Time from which the marks are hidden. They must be seen once before this time.",
    ]
    end: Annotated[
        float, UnboundedTime(above=0), PerRun(()), "Time until which the marks are hidden."
    ] = math.inf
    target: Annotated[
        str | None, FrameReference, "Object with the hidden marks. None: all objects."
    ] = None
    camera: Annotated[
        str | None, FrameReference, "Camera that does not see the marks. None: all cameras."
    ] = None

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            marks: int | Sequence[int],
            start: float,
            end: float = math.inf,
            target: str | None = None,
            camera: str | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.end > self.start:
            raise InputError(f"an occlusion from {self.start:g} s must end later, not {self.end:g}")

    def concerns(self, camera: str, target: str) -> bool:
        """Return whether the occlusion hides marks of a target from a camera."""
        return self.camera in (None, camera) and self.target in (None, target)

    def check(self, groups: Sequence[MarkGroup]) -> None:
        for kind in ("camera", "target"):
            name, known = getattr(self, kind), sorted({getattr(each, kind) for each in groups})
            if name is not None and name not in known:
                hint = suggest_names(name, known, f"{kind}s of the task")
                raise InputError(f"occlusion: the task has no {kind} {name!r}; {hint}")
        for each in groups:
            if self.concerns(each.camera, each.target) and max(self.marks) >= each.size:
                raise InputError(
                    f"occlusion: '{each.target}' has {each.size} marks, numbered from 0; there "
                    f"is no {max(self.marks)}"
                )

    def add_stages(self, image: ImageRows) -> None:
        number = image.program.number
        marks = [
            image.hidden[each.first + mark]
            for each in image.groups
            if self.concerns(each.camera, each.target)
            for mark in self.marks
        ]
        options = {"dt": image.dt, "latency": image.latency, "marks": marks}
        image.program.add(hide_marks, **options, start=number(self.start), end=number(self.end))

    def stated(self, facts: RunFacts) -> Statement:
        until = f"until {self.end:.3g} s" if self.end < math.inf else "on"
        several = len(self.marks) > 1
        sentence = (
            f"Mark{'s' * several} {', '.join(map(str, self.marks))} {'are' if several else 'is'} "
            f"hidden from {self.start:.3g} s {until}, and the law continues without them."
        )
        numbers = {"marks": float(len(self.marks)), "start_s": self.start, "end_s": self.end}
        return sentence, numbers


OcclusionList = Annotated[
    tuple[Occlusion, ...], ListOf(Table(Occlusion), alone=True), "Occlusions of marks."
]
