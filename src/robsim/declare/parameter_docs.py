"""Sections "Parameters" in the docstrings of declared classes."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Iterator
from textwrap import indent, wrap
from types import NoneType, UnionType
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

from robsim.base.parameter_names import name_parameters
from robsim.declare.context import MISSING
from robsim.declare.fields import DeclaredField, fields_of

K = TypeVar("K", bound=type)
WIDTH = 92  # longest line in characters


class _Docstring:
    """A class docstring that is completed at its first use, because reading fields is slow."""

    def __init__(self, text: str):
        self.text = text

    def __get__(self, value: object, kind: type) -> str:
        return add_parameters_section(self.text, _list_arguments(kind))


def _list_arguments(kind: type) -> tuple[DeclaredField, ...]:
    """Return the declared fields of a dataclass, keyword-only fields last."""
    keyword = {each.name: each.kw_only is True for each in dataclasses.fields(kind)}
    return tuple(sorted(fields_of(kind), key=lambda each: keyword[each.name]))


class _LazySignature:
    """The signature of a class with plain types, computed when it is read."""

    def __get__(self, value: object, kind: type) -> inspect.Signature | None:
        return get_plain_signature(kind)


class TypeText(str):
    """The text of a type, which a signature shows without quotes."""

    def __repr__(self) -> str:
        return str(self)


def get_plain_signature(kind: type[Any]) -> inspect.Signature | None:
    """Return the signature of a dataclass with the names of its types, without specs and meanings.

    None if the class has an `__init__` of its own, which Python then inspects as usual.
    """
    own = list(inspect.signature(kind.__init__).parameters.values())[1:]
    if {each.name for each in own} != {each.name for each in dataclasses.fields(kind) if each.init}:
        return None
    try:
        hints = get_type_hints(kind)
    except NameError:  # a type that only type checkers import
        hints = {}
    plain = [each.replace(annotation=_format_annotation(each, hints)) for each in own]
    return inspect.Signature(plain)


def _format_annotation(parameter: inspect.Parameter, hints: dict[str, Any]) -> TypeText:
    """Return the type of a parameter as text: by its alias, and without None if that is default."""
    written = parameter.annotation
    if isinstance(written, TypeText):
        text = str(written)
    elif isinstance(written, str) and (short := _FIRST_ARGUMENT.match(written)):
        text = short[1]
    else:  # an alias, or a module without postponed annotations
        hint = hints.get(parameter.name, written)
        text = format_type(TypeText(hint) if isinstance(hint, str) else hint)
    return TypeText(text.removesuffix(" | None") if parameter.default is None else text)


def format_type(hint: Any) -> str:
    """Return a type as text, without the modules of its classes.

    >>> from robsim import Pose
    >>> format_type(Pose | float | None)
    'Pose | float | None'
    """
    if get_origin(hint) in (Union, UnionType):
        return " | ".join(format_type(each) for each in get_args(hint))
    text = "None" if hint is NoneType else _MODULES.sub("", inspect.formatannotation(hint))
    return text.replace("ndarray[tuple[Any, ...], dtype[float64]]", "NDArray[float64]")


_MODULES = re.compile(r"\b(?:[A-Za-z_]\w*\.)+(?=[A-Za-z_])")


def described(kind: K) -> K:
    """Add the declared fields of a dataclass to its docstring, and check the names of arguments.

    The section "Parameters" is placed before the first example. An unknown argument raises
    ParameterError with the nearest name. Write the decorator above `@dataclass`; `register`
    includes it.

    >>> from robsim.tasks import NearBorder
    >>> "margin : a positive number (px)" in NearBorder.__doc__
    True
    """
    text = kind.__dict__.get("__doc__")
    if isinstance(text, str) and dataclasses.is_dataclass(kind):
        docstring: Any = _Docstring(text)
        kind.__doc__ = docstring
        _shorten_annotations(kind.__init__)
        setattr(kind, "__signature__", _LazySignature())  # noqa: B010  # which mypy does not know
        name_parameters(kind)
    return kind


def _shorten_annotations(function: Any) -> None:
    """Let the annotations of a generated `__init__` be types alone, as `help` shows them."""
    for name, text in getattr(function, "__annotations__", {}).items():
        if isinstance(text, str) and text.startswith("Annotated["):
            short = _FIRST_ARGUMENT.match(text)
            function.__annotations__[name] = TypeText(short[1] if short else text)


_BRACKETS = r"\[(?:[^\[\]]|\[[^\]]*\])*\]"  # with brackets inside
_FIRST_ARGUMENT = re.compile(rf"Annotated\[((?:[^,\[\]]|{_BRACKETS})+),")


def add_parameters_section(text: str, fields: tuple[DeclaredField, ...]) -> str:
    """Return a docstring with a section on fields, before the first example.

    >>> from robsim.declare import Length
    >>> radius = DeclaredField("radius", Length(above=0), "Its radius.")
    >>> add_parameters_section("A ball.", (radius,)).splitlines()[-2:]
    ['radius : a positive number (m)', '    Its radius.']
    """
    text = inspect.cleandoc(text)
    if not fields:
        return text
    lines = [
        "Parameters",
        "----------",
        *(line for each in fields for line in _format_parameter(each)),
    ]
    rest = _FOLLOWING.search(text)
    about, after = (text[: rest.start()], text[rest.start() :]) if rest else (text, "")
    return "\n\n".join(filter(None, [about.rstrip(), "\n".join(lines), after]))


_FOLLOWING = re.compile(  # the sections that follow "Parameters", or the first example
    r"^(?:(?:Attributes|Returns|Raises|Warns|See Also|Notes|References|Examples)\n-{3,}$|>>> )",
    re.M,
)


def _format_parameter(each: DeclaredField) -> Iterator[str]:
    default = "" if each.default is MISSING else f", default {each.default!r}"
    yield from wrap(f"{each.name} : {each.spec.accepts()}{default}", WIDTH, subsequent_indent="  ")
    yield from indent("\n".join(wrap(each.meaning, WIDTH - 4)), "    ").splitlines()
