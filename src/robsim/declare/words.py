"""Texts: free, names, colors and words of a few."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar

from robsim.base.errors import InputError, said, suggest
from robsim.base.names import NAME_PATTERN, checked_name
from robsim.declare.families import plural
from robsim.declare.phrases import either_of
from robsim.declare.spec import Context, NoText, Raw, Spec, expected


@dataclass(frozen=True)
class Text(Spec):
    """A text of a bounded length, which may have to fit a pattern."""

    most: int = 2000
    pattern: str | None = None
    least: int = 0

    def check(self, value: Any, what: str) -> str:
        if not isinstance(value, str):
            raise InputError(f"{what}: expected a text, got {said(value)}")
        return value

    def read(self, raw: Raw, c: Context) -> str:
        if not isinstance(raw, str):
            raise expected("a valid string", raw)
        if not self.least <= len(raw) <= self.most:
            raise expected(f"a string of {self.least} to {self.most} characters", raw)
        if self.pattern and not re.fullmatch(self.pattern, raw):
            raise expected(f"a string of the pattern {self.pattern}", raw)
        return raw

    def write(self, value: Any, c: Context) -> str:
        if not isinstance(value, str):
            raise NoText(f"{said(value)} is not a text")
        return value

    def words(self) -> str:
        return "a text"

    def schema(self, define: Any) -> dict[str, Any]:
        pattern = {"pattern": f"^{self.pattern}$"} if self.pattern else {}
        return {"type": "string", "minLength": self.least, "maxLength": self.most, **pattern}


@dataclass(frozen=True)
class Name(Text):
    """A name that is safe in files, figures and paths."""

    most: int = 64

    def read(self, raw: Raw, c: Context) -> str:
        return checked_name(raw, "name")

    def words(self) -> str:
        return "a name"

    def schema(self, define: Any) -> dict[str, Any]:
        return {"type": "string", "pattern": f"^{NAME_PATTERN}$"}


@dataclass(frozen=True)
class ColorSpec(Text):
    """A colour by a name that Matplotlib knows; in Python in any form that Matplotlib takes."""

    pattern: str | None = r"[A-Za-z0-9#][A-Za-z0-9 #:._-]{0,63}"

    def check(self, value: Any, what: str) -> Any:
        return value  # which only Matplotlib knows

    def write(self, value: Any, c: Context) -> str:
        if not isinstance(value, str):
            raise NoText(f"the color {said(value)} is not a text")
        return value


Color = ColorSpec()


@dataclass(frozen=True)
class Word(Spec):
    """One of a few words."""

    choices: tuple[str, ...]
    noun: str = "choice"
    form: ClassVar[str] = "plain"

    def check(self, value: Any, what: str) -> str:
        if not isinstance(value, str) or value not in self.choices:
            hint = suggest(value, self.choices, plural(self.noun))
            raise InputError(f"{what}: no {self.noun} {said(value)}; {hint}")
        return value

    def read(self, raw: Raw, c: Context) -> str:
        if not isinstance(raw, str) or raw not in self.choices:
            raise expected(self.words(), raw)
        return raw

    def write(self, value: Any, c: Context) -> str:
        return str(value)

    def words(self) -> str:
        return either_of(*map(repr, self.choices))

    def schema(self, define: Any) -> dict[str, Any]:
        return {"enum": list(self.choices)}

    def controls(self, value: Any, place: Any) -> Iterable[Any]:
        return [] if value is None else [place.control("choice", value, options=self.choices)]


Reference = Text(most=129)  # robot.link
