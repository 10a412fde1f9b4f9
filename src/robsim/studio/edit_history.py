"""The edits of a session: experiments and second schemes, which can be undone and redone."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from robsim.run.experiment import Experiment

MOST_EDITS = 200  # largest number of stored edits, besides the original
PAUSE = 1.0  # seconds of wall clock that separate two changes of the same values without a stroke


@dataclass(frozen=True, eq=False)
class Edit:
    """An experiment, its changes {dotted name: value} since it was opened, and a second scheme.

    `second` {dotted name: value} are the values that differ in the second scheme; it is empty
    without one.
    """

    experiment: Experiment
    changes: Mapping[str, Any] = field(default_factory=dict)
    second: Mapping[str, Any] = field(default_factory=dict)


class EditHistory:
    """The edits in their order, and the number of the present one.

    Consecutive changes of the same values are one edit if they belong to one stroke of a pointer,
    such as the drag of a slider, or if neither has a stroke and they follow within `PAUSE` seconds.
    If more than `MOST_EDITS` are made, the earliest ones are forgotten; the original remains.
    """

    def __init__(self, original: Edit) -> None:
        self.original = original
        self._edits, self._present = [original], 0
        self._merging: tuple[object, object, float] = None, None, 0.0  # values, stroke, time

    @property
    def before(self) -> Edit | None:
        """The edit to which `undo` returns; None if there is none."""
        return self._edits[self._present - 1] if self._present else None

    @property
    def after(self) -> Edit | None:
        """The edit that was undone last; None if there is none."""
        later = self._edits[self._present + 1 :]
        return later[0] if later else None

    def add(self, edit: Edit, values: object = None, stroke: object = None) -> None:
        """Store an edit of some values in place of the edits that were undone.

        It replaces the present edit if both are one edit; `stroke` is the name of the stroke.
        """
        now = time.monotonic()
        *last, then = self._merging
        follows = stroke is not None or now - then < PAUSE
        merges = values is not None and [values, stroke] == last and follows and self._present > 0
        self._edits[self._present + (0 if merges else 1) :] = [edit]
        del self._edits[: -MOST_EDITS - 1]
        self._present, self._merging = len(self._edits) - 1, (values, stroke, now)

    def go_to(self, edit: Edit) -> None:
        """Make a stored edit the present one."""
        self._present = next(i for i, each in enumerate(self._edits) if each is edit)
        self._merging = None, None, 0.0
