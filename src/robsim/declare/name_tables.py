"""Tables with free keys: a name or a list of names for each name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from robsim.base.errors import InputError, format_value
from robsim.declare.context import Context, FieldValue, Raw
from robsim.declare.spec import DefineSchema, JSONSchema, Spec, make_expected_error
from robsim.declare.texts import Text

NAME = Text(least=1)


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
        text = NAME.schema(define)
        each = {"type": "array", "items": text} if self.several else text
        return {"type": "object", "additionalProperties": each}

    def _fits(self, key: object, value: object) -> bool:
        """Return whether a pair has a name, and a text or a list of texts."""
        listed = isinstance(value, list | tuple)
        texts = [key, *value] if isinstance(value, list | tuple) else [key, value]
        return listed == self.several and not any(map(NAME.find_violation, texts))
