"""Constraints of a law as entries and arrays of a recording."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.page.recording_frames import Entry
from robsim.run.constraint_states import ConstraintStates
from robsim.servo.constraints.field_of_view import FieldOfView
from robsim.servo.constraints.row_names import parse_row_name

WORD = 16  # constraints in a number of an array; float32 represents its bits exactly


def build_constraint_entries(states: ConstraintStates) -> list[Entry]:
    """Return the name of each constraint, the mark that it concerns, and its owners if known."""
    entries = [{"name": name, **parse_row_name(name)} for name in states.names]
    pairs = zip(entries, states.owners, strict=True) if states.owners else ()
    return [{**entry, "of": list(own)} for entry, own in pairs] or entries


def pack_constraint_states(states: ConstraintStates) -> dict[str, NDArray[np.uint32]]:
    """Return the arrays of the states, with a bit for each constraint."""
    return {
        "constraints holding": _pack_bits(states.holding),
        "constraints yielding": _pack_bits(states.yielding),
    }


def _pack_bits(flags: NDArray[np.bool_]) -> NDArray[np.uint32]:
    """Return flags (T, c) as numbers (T, words) of `WORD` bits, the first flag the lowest bit."""
    count, words = len(flags), -(-flags.shape[1] // WORD)
    padded = np.pad(flags, ((0, 0), (0, words * WORD - flags.shape[1])))
    powers = 1 << np.arange(WORD, dtype=np.uint32)
    bits = padded.reshape(count, words, WORD) * powers
    packed: NDArray[np.uint32] = bits.sum(axis=-1, dtype=np.uint32)
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
