"""Text fields: free texts, names, colours, words from a list, and tables of names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import ClassVar

from robsim.base.colors import check_color
from robsim.base.errors import InputError, format_value, is_known_name, suggest_names
from robsim.base.name_check import LONGEST_NAME, NAME_PATTERN, check_name
from robsim.declare.context import Context, FieldValue, Raw
from robsim.declare.controls import Control, ControlPlace
from robsim.declare.error_phrases import join_alternatives, pluralize
from robsim.declare.scalars import PlainValue
from robsim.declare.spec import DefineSchema, JSONSchema, Spec, make_expected_error


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


NONEMPTY = Text(least=1)


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


@dataclass(frozen=True)
class NameTable(Spec):
    """A field with a table {name: text} or {name: texts}, which becomes a tuple of pairs.

    Parameters
    ----------
    several : bool, default False
        Whether each value is a list of texts.

    Examples
    --------
    >>> NameTable().check({"shoulder": "shoulder_pan_joint"}, "names")
    (('shoulder', 'shoulder_pan_joint'),)
    """

    several: bool = False
    forms: ClassVar[tuple[str, ...]] = ("table",)

    def check(self, value: FieldValue, what: str) -> FieldValue:
        try:
            pairs = tuple(dict(value).items())
        except (TypeError, ValueError):
            pairs = ((None, None),)
        if not all(self._fits(key, each) for key, each in pairs):
            raise InputError(f"{what}: expected {self.words()}, got {format_value(value)}")
        return tuple((key, tuple(each)) for key, each in pairs) if self.several else pairs

    def read(self, raw: Raw, c: Context) -> FieldValue:
        if not isinstance(raw, Mapping):
            raise make_expected_error(self.words(), raw)
        return self.check(raw, str(c.path[-1]) if c.path else "value")

    def write(self, value: FieldValue, c: Context) -> Raw:
        return {key: list(each) if self.several else each for key, each in value}

    def put(self, table: dict[str, Raw], name: str, value: FieldValue, c: Context) -> None:
        if value:
            super().put(table, name, value, c)

    def words(self) -> str:
        return f"a table {{name: {'list of texts' if self.several else 'text'}}}"

    def schema(self, define: DefineSchema) -> JSONSchema:
        text = NONEMPTY.schema(define)
        each = {"type": "array", "items": text} if self.several else text
        return {"type": "object", "additionalProperties": each}

    def _fits(self, key: object, value: object) -> bool:
        """Return whether a pair has a name, and a text or a list of texts."""
        listed = isinstance(value, list | tuple)
        texts = [key, *value] if isinstance(value, list | tuple) else [key, value]
        return listed == self.several and not any(map(NONEMPTY.find_violation, texts))


FrameReference = Text(most=129)  # robot.link
