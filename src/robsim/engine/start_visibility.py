"""The check that the cameras see the marks of a task at the start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robsim.base.errors import InputError
from robsim.engine.chunk import ChunkProgress
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.vision.camera import Visibility

_EMPTY = (Outcome.NO_GRADIENT, Outcome.NOTHING_IN_VIEW)
_BLIND = (Outcome.OUT_OF_IMAGE, Outcome.BEHIND_CAMERA, Outcome.UNDETECTED, *_EMPTY)
_WHERE = {
    Visibility.BEHIND_CAMERA: "behind the camera",
    Visibility.OUT_OF_IMAGE: "outside the image",
}


def check_start_visibility(loop: Loop) -> None:
    """Raise InputError if a camera lacks marks that the task needs at a start."""
    first = replace(loop, steps=1)
    every = np.arange(len(loop.q0))
    for begin in range(0, len(every), loop.most_runs_together):
        chunk = every[begin : begin + loop.most_runs_together]
        first.advance(ChunkProgress(chunk), lambda share: None)
    ended = first.recorder
    blind = np.flatnonzero(np.isin(ended.outcome, _BLIND) & (ended.end_step == 0))
    if blind.size:
        at = int(blind[0])
        raise InputError(_describe_missing_marks(loop, at, Outcome(int(ended.outcome[at]))))


def _describe_missing_marks(loop: Loop, at: int, outcome: Outcome) -> str:
    """Return a message about the camera and the marks that it does not see at a start."""
    start_label = f"start {at + 1} of {len(loop.q0)}" if len(loop.q0) > 1 else "start"
    if outcome in _EMPTY:
        return f"{start_label}: {outcome.message}"
    if outcome == Outcome.UNDETECTED:
        names = sorted({type(each).__name__ for each in loop.controller.detectors.values()})
        return f"{start_label}: {' and '.join(names)} does not find every mark in the first picture"
    excused = loop.controller.optional_pairs
    for sight in (each for each in loop.controller.sights if each.key not in excused):
        seen = sight.scene.view(loop.q0[at], sight.eye.name, sight.target.name).visibility
        for flag, where in _WHERE.items():
            marks = np.flatnonzero(seen == flag)
            if marks.size:
                label = f"mark{'s' * (marks.size > 1)} {', '.join(map(str, marks))}"
                return (
                    f"{start_label}: '{sight.eye.name}' does not see {label} of "
                    f"'{sight.target.name}': {where}"
                )
    return f"{start_label}: the camera sees too few marks to command by"
