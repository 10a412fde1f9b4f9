"""Fields with a value in one of several forms."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

from robsim.base.errors import InputError, format_value
from robsim.declare.context import Context, FieldValue, NoTextError, Raw
from robsim.declare.controls import Control, ControlPlace
from robsim.declare.spec import (
    DeclaredClass,
    DefineSchema,
    JSONSchema,
    PathPart,
    Spec,
    make_expected_error,
)


@dataclass(frozen=True)
class OneOf(Spec):
    """A field with a value in one of several forms: plain, a list, or a table.

    Parameters
    ----------
    *specs : Spec
        Specs of the forms, tried in this order.
    words : str, optional
        Phrase for messages. Default: the phrases of the specs.

    Examples
    --------
    >>> from robsim.declare import Number, Word
    >>> OneOf(Word(("auto",)), Number(above=0)).check(2, "size")
    2.0
    """

    specs: tuple[Spec, ...]
    summary: str = ""  # phrase for messages; "": the phrases of the specs

    def __init__(self, *specs: Spec, words: str = ""):
        vars(self).update(specs=specs, summary=words)

    @property
    def forms(self) -> tuple[str, ...]:  # type: ignore[override]
        """The forms of all specs."""
        return tuple(form for spec in self.specs for form in spec.forms)

    def check(self, value: object, what: str) -> FieldValue:
        for spec in self.specs:
            try:
                return spec.check(value, what)
            except InputError:
                continue
        raise InputError(f"{what}: expected {self.words()}, got {format_value(value)}")

    def read(self, raw: Raw, c: Context) -> FieldValue:
        fits = [spec for spec in self.specs if _get_raw_form(raw) in spec.forms]
        if len(fits) == 1:
            return fits[0].read(raw, c)
        for spec in fits:
            try:
                return spec.read(raw, c)
            except InputError:
                continue
        raise make_expected_error(self.words(), raw)

    def write(self, value: object, c: Context) -> Raw:
        for spec in self.specs:
            try:
                return spec.write(spec.check(value, "value"), c)
            except (InputError, NoTextError, TypeError):
                continue
        raise NoTextError(f"{type(value).__name__} is Python code")

    def words(self) -> str:
        return self.summary or ", or ".join(spec.words() for spec in self.specs)

    def accepts(self) -> str:
        return self.summary or ", or ".join(spec.accepts() for spec in self.specs)

    def schema(self, define: DefineSchema) -> JSONSchema:
        return {"anyOf": [spec.schema(define) for spec in self.specs]}

    def controls(self, value: object, place: ControlPlace) -> Iterable[Control]:
        return self._find_spec(value).controls(value, place)

    def parts(self, keys: list[str], value: object, c: Context) -> list[PathPart]:
        return self._find_spec(value).parts(keys, value, c)

    def _find_spec(self, value: object) -> Spec:
        """Return the spec of a stored value; a spec without controls and parts if none fits."""
        for spec in self.specs:
            with suppress(InputError, TypeError):
                spec.check(value, "value")
                return spec
        return Spec()

    def list_inner_classes(self) -> Sequence[DeclaredClass]:
        return [kind for spec in self.specs for kind in spec.list_inner_classes()]


def _get_raw_form(raw: Raw) -> str:
    if isinstance(raw, Mapping):
        return "table"
    return "list" if isinstance(raw, list) else "plain"
