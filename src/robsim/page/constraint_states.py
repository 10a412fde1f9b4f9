"""Constraints of a law on a page: which of them act at each instant, and where they are seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robsim.page.recording_frames import Entry
from robsim.servo.constraints.field_of_view import FieldOfView
from robsim.servo.constraints.row_names import name_first_row, parse_row_name

if TYPE_CHECKING:
    from robsim.plot.run_data import RunVariables

WORD = 16  # constraints in a number of an array; float32 represents its bits exactly
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ConstraintStates:
    """Constraints that hold back or yield to the command at T instants.

    Rows of one name, such as the rows of a constraint for several depths of a mark, are one
    constraint.

    Attributes
    ----------
    names : tuple of str
        Names of the c constraints.
    holding : ndarray of bool, shape (T, c)
        Whether a constraint holds the command back.
    yielding : ndarray of bool, shape (T, c)
        Whether a constraint gave way, because no command satisfies all.
    owners : tuple of tuple of str
        Dotted names of the values to which each constraint belongs; empty if they are unknown.
    """

    names: tuple[str, ...]
    holding: Flags
    yielding: Flags
    owners: tuple[tuple[str, ...], ...] = ()

    @classmethod
    def of(cls, run: RunVariables, owners: Sequence[Sequence[str]] = ()) -> ConstraintStates | None:
        """Return the states of a single run; None for a law without constraints.

        `owners` are the dotted names of the values of each row.
        """
        if "active" not in run:
            return None
        labels = [str(label) for label in run["constraint"].values]
        first = [name_first_row(label, labels) for label in labels]
        names = list(dict.fromkeys(first))
        rows = [np.array([each == name for each in first]) for name in names]
        flags = run["active"].values > 0, run["slack"].values > 0
        holding, yielding = (
            np.stack([np.any(part[:, own], axis=1) for own in rows], axis=1) for part in flags
        )
        return cls(
            tuple(names),
            holding,
            yielding,
            tuple(tuple(owners[first.index(name)]) for name in names) if owners else (),
        )

    def select_acting(self) -> ConstraintStates:
        """Return the states of the constraints that ever hold back or yield to the command."""
        acts: Flags = np.any(self.holding | self.yielding, axis=0)
        return replace(
            self,
            names=tuple(name for name, one in zip(self.names, acts, strict=True) if one),
            holding=self.holding[:, acts],
            yielding=self.yielding[:, acts],
        )

    @property
    def entries(self) -> list[Entry]:
        """The entries of the header: the name of each constraint, and the mark it concerns."""
        entries = [{"name": name, **parse_row_name(name)} for name in self.names]
        pairs = zip(entries, self.owners, strict=True) if self.owners else ()
        return [{**entry, "of": list(own)} for entry, own in pairs] or entries

    @property
    def arrays(self) -> dict[str, NDArray[Any]]:
        """The arrays of the recording, a bit for each constraint."""
        return {
            "constraints holding": _pack_bits(self.holding),
            "constraints yielding": _pack_bits(self.yielding),
        }


def _pack_bits(flags: Flags) -> NDArray[np.uint32]:
    """Return flags (T, c) as numbers (T, words) of `WORD` bits, the first flag the lowest bit."""
    words = -(-flags.shape[1] // WORD)
    padded = np.pad(flags, ((0, 0), (0, words * WORD - flags.shape[1])))
    powers = 1 << np.arange(WORD, dtype=np.uint32)
    packed: NDArray[np.uint32] = (padded.reshape(-1, words, WORD) * powers).sum(
        axis=-1, dtype=np.uint32
    )
    return packed


def list_view_margins(task: Any) -> list[tuple[str | None, float]]:
    """Return camera and margin in pixels of each constraint of the field of view of a task.

    The camera None is every camera of the task.
    """
    return [
        (one.camera, float(np.max(one.margin)))
        for one in getattr(getattr(task, "law", None), "constraints", ())
        if isinstance(one, FieldOfView)
    ]
