"""Selection of the marks of a constraint by the names of camera and target, and its fields."""

from __future__ import annotations

from typing import Annotated, Protocol

from robsim.base.errors import InputError, suggest_names
from robsim.declare import Number, PerRun
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.servo.constraints.constraint import ConstraintInputs, ConstraintPlace, MarkView
from robsim.servo.feature_block import SceneName

CameraOfMarks = Annotated[
    str | None, SceneName(find="camera"), "Name of the camera; None: all cameras of the task."
]
TargetOfMarks = Annotated[
    str | None, SceneName(find="object"), "Name of the object; None: all targets of the task."
]
DepthError = Annotated[
    float, Number(least=0.0, below=1.0), PerRun(()), "Largest relative error of 1/Z of the belief."
]


class MarkConstraint(Protocol):
    """Constraint with the names of a camera and a target; None selects all."""

    @property
    def camera(self) -> str | None:
        """Name of the camera."""

    @property
    def target(self) -> str | None:
        """Name of the object with the marks."""


def select_sights(one: MarkConstraint, place: ConstraintPlace) -> list[CameraTarget]:
    """Return the camera-target pairs of a constraint; raise InputError if there are none."""
    sights = [each for each in place.sights if _selects(one, each.key)]
    if not sights:
        name = type(one).__name__
        if not place.sights:
            raise InputError(f"{name}: the task has no camera with marks")
        for i, given in enumerate((one.camera, one.target)):
            known = {sight.key[i] for sight in place.sights}
            if given is not None and given not in known:
                noun = ("camera", "target")[i]
                hint = suggest_names(given, sorted(known), f"{noun}s of the task")
                raise InputError(f"{name}: the task has no {noun} '{given}'; {hint}")
        raise InputError(f"{name}: '{one.camera}' does not see '{one.target}' in this task")
    return sights


def select_views(one: MarkConstraint, of: ConstraintInputs) -> list[MarkView]:
    """Return the views of a constraint."""
    return [view for key, view in of.views.items() if _selects(one, key)]


def name_marks(sights: list[CameraTarget], place: ConstraintPlace) -> list[str]:
    """Return names such as "mark 2", with target and camera if the task has several pairs."""
    several = len(place.sights) > 1
    return [
        f"mark {i}" + (f" of {sight.target.name} in {sight.eye.name}" if several else "")
        for sight in sights
        for i in range(len(sight.target.marks))
    ]


def _selects(one: MarkConstraint, key: PairKey) -> bool:
    """Return whether a constraint selects a camera-target pair."""
    wanted = one.camera, one.target
    return all(name in (None, own) for name, own in zip(wanted, key, strict=True))
