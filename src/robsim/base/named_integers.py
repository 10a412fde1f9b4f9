"""Integers with names, such as the outcomes of a run, which report an unknown number or name."""

from __future__ import annotations

from enum import IntEnum
from typing import NoReturn

from robsim.base.errors import InputError, format_value, suggest_names


class NamedInteger(IntEnum):
    """Base of enumerations of integers, in which an unknown number raises InputError.

    The message gives all names with their numbers, and the nearest name to a text.

    Examples
    --------
    >>> import robsim as rs
    >>> rs.Outcome(1) is rs.Outcome.CONVERGED
    True
    >>> rs.Outcome("converged")
    Traceback (most recent call last):
    ...
    robsim.base.errors.InputError: no number 'converged' in Outcome; did you mean 'CONVERGED'? ...
    """

    @classmethod
    def _missing_(cls, value: object) -> NoReturn:
        name = value.upper().replace(" ", "_") if isinstance(value, str) else value
        members = ", ".join(f"{each.name} = {each.value}" for each in cls)
        nearest, guess, _ = suggest_names(name, cls.__members__, "").rpartition("? ")
        raise InputError(
            f"no number {format_value(value)} in {cls.__name__}; {nearest}{guess}members: "
            f"{members}, as in {cls.__name__}.{list(cls)[-1].name}"
        )
