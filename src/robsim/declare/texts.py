"""Text fields: free texts, names, colours and words from a list."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

from robsim.base.colors import check_color
from robsim.base.errors import InputError, format_value, is_known_name, suggest_names
from robsim.base.name_check import LONGEST_NAME, NAME_PATTERN, check_name
from robsim.declare.context import Context, FieldValue, Raw
from robsim.declare.controls import Control, ControlPlace
from robsim.declare.error_phrases import join_alternatives, pluralize
from robsim.declare.scalars import PlainValue
from robsim.declare.spec import DefineSchema, JSONSchema


@dataclass(frozen=True)
class Text(PlainValue):
    """A field with a text.

    Parameters
    ----------
    most, least : int, default 2000 and 0
        Bounds of the number of characters.
    pattern : str, optional
        Regular expression that the whole text must match.

    Examples
    --------
    >>> Text(pattern="[a-z]+").check("abc", "word")
    'abc'
    """

    most: int = 2000
    pattern: str | None = None
    least: int = 0
    phrase: ClassVar[str] = "a text"

    def find_violation(self, value: FieldValue) -> str:
        fits = isinstance(value, str) and self.least <= len(value) <= self.most
        if fits and re.fullmatch(self.pattern or "(?s:.*)", value):
            return ""
        pattern = f", of the pattern {self.pattern}" if self.pattern else ""
        return f"{self.words()}, of {self.least} to {self.most} characters{pattern}"

    def check(self, value: object, what: str) -> FieldValue:
        if demand := self.find_violation(value):
            raise InputError(f"{what} must be {demand}, got {format_value(value)}")
        return value

    def schema(self, define: DefineSchema) -> JSONSchema:
        pattern = {"pattern": f"^{self.pattern}$"} if self.pattern else {}
        return {"type": "string", "minLength": self.least, "maxLength": self.most, **pattern}


@dataclass(frozen=True)
class Name(Text):
    """A field with a name that is safe in files, figures and paths.

    Examples
    --------
    >>> Name().check("left_arm", "name")
    'left_arm'
    """

    most: int = LONGEST_NAME
    pattern: str | None = NAME_PATTERN
    phrase: ClassVar[str] = "a name"

    def read(self, raw: Raw, c: Context) -> str:
        return check_name(raw, "name")


@dataclass(frozen=True)
class ColorSpec(Text):
    """A colour by its Matplotlib name; Python code may use any form that Matplotlib accepts."""

    most: int = 64
    pattern: str | None = r"[A-Za-z0-9#][A-Za-z0-9 #:._-]*"
    phrase: ClassVar[str] = "the name of a color"

    def check(self, value: object, what: str) -> FieldValue:
        return check_color(value, f"{what}: ")

    def read(self, raw: Raw, c: Context) -> FieldValue:
        return check_color(super().read(raw, c))


Color = ColorSpec()


@dataclass(frozen=True)
class Word(PlainValue):
    """A field with one of a few words.

    Parameters
    ----------
    choices : tuple of str
        Valid words.
    noun : str, default "choice"
        Noun for messages.

    Examples
    --------
    >>> Word(("near", "far")).words()
    "'near' or 'far'"
    """

    choices: tuple[str, ...]
    noun: str = "choice"

    def find_violation(self, value: object) -> str:
        return "" if is_known_name(value, self.choices) else self.words()

    def check(self, value: object, what: str) -> FieldValue:
        if self.find_violation(value):
            hint = suggest_names(value, self.choices, pluralize(self.noun))
            raise InputError(f"{what}: no {self.noun} {format_value(value)}; {hint}")
        return value

    def words(self) -> str:
        return join_alternatives(*map(repr, self.choices))

    def schema(self, define: DefineSchema) -> JSONSchema:
        return {"enum": list(self.choices)}

    def controls(self, value: object, place: ControlPlace) -> Iterable[Control]:
        return [] if value is None else [place.control("choice", value, options=self.choices)]


FrameReference = Text(most=129)  # robot.link
