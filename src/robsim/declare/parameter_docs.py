"""The parameters of declared classes in their docstrings, as `help` and editors show them."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Iterator
from textwrap import indent, wrap
from typing import Any, TypeVar

from robsim.declare.fields import DeclaredField, fields_of
from robsim.declare.spec import MISSING

K = TypeVar("K", bound=type[Any])
WIDTH = 92  # of a line


class _Docstring:
    """A class docstring that is completed when it is read: most are not, and fields take time."""

    def __init__(self, text: str):
        self.text = text

    def __get__(self, value: object, kind: type[Any]) -> str:
        return add_parameters_section(self.text, _list_arguments(kind))


def _list_arguments(kind: type[Any]) -> tuple[DeclaredField, ...]:
    """Return the declared fields of a dataclass, those that are given by keyword alone last."""
    keyword = {each.name: each.kw_only is True for each in dataclasses.fields(kind)}
    return tuple(sorted(fields_of(kind), key=lambda each: keyword[each.name]))


def described(kind: K) -> K:
    """Return a dataclass whose docstring lists its declared fields as parameters.

    A section "Parameters" in the manner of NumPy stands before the first example. As a decorator
    it comes before `@dataclass`; `register` does the same.

    >>> from robsim.tasks import NearBorder
    >>> "margin : a positive number (px)" in NearBorder.__doc__
    True
    """
    text = kind.__dict__.get("__doc__")
    if isinstance(text, str) and dataclasses.is_dataclass(kind):
        docstring: Any = _Docstring(text)
        kind.__doc__ = docstring
    return kind


def add_parameters_section(text: str, fields: tuple[DeclaredField, ...]) -> str:
    """Return a docstring with a section on these fields, before the first example.

    >>> from robsim.declare import Length
    >>> print(add_parameters_section("A ball.", (DeclaredField("radius", Length(above=0), "Its radius."),)))
    A ball.
    <BLANKLINE>
    Parameters
    ----------
    radius : a positive number (m)
        Its radius.
    """
    text = inspect.cleandoc(text)
    if not fields:
        return text
    lines = [
        "Parameters",
        "----------",
        *(line for each in fields for line in _format_parameter(each)),
    ]
    about, prompt, example = text.partition("\n>>> ")
    section = "\n".join(lines)
    return f"{about.rstrip()}\n\n{section}" + (f"\n{prompt}{example}" if prompt else "")


def _format_parameter(each: DeclaredField) -> Iterator[str]:
    default = "" if each.default is MISSING else f", default {each.default!r}"
    yield from wrap(f"{each.name} : {each.spec.accepts()}{default}", WIDTH, subsequent_indent="  ")
    yield from indent("\n".join(wrap(each.meaning, WIDTH - 4)), "    ").splitlines()
