"""The check of the names of arguments, by which a class reports the nearest parameter."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import CO_VARKEYWORDS
from typing import Any, TypeVar

from robsim.base.errors import ParameterError, suggest_names

K = TypeVar("K", bound=type)


def name_parameters(kind: K) -> K:
    """Let a class report an unknown parameter with the nearest and all names.

    Write the decorator above `@dataclass`; `described` includes it. A class without an `__init__`
    of its own, or with one that takes any name, stays as it is.

    >>> import robsim as rs
    >>> rs.Safety(sped=1.0)
    Traceback (most recent call last):
    ...
    robsim.base.errors.ParameterError: Safety has no parameter 'sped'; did you mean 'speed'? ...
    """
    own: Any = kind.__dict__.get("__init__")
    code = getattr(own, "__code__", None)
    if code is not None and not code.co_flags & CO_VARKEYWORDS:
        names = code.co_varnames[1 : code.co_argcount + code.co_kwonlyargcount]
        setattr(kind, "__init__", _check_names(own, names))  # noqa: B010  # which mypy forbids
    return kind


def _check_names(function: Callable[..., None], names: tuple[str, ...]) -> Callable[..., None]:
    """Return an `__init__` that raises ParameterError for other names than these."""
    known = frozenset(names)

    @wraps(function)
    def __init__(self: object, *args: Any, **kwargs: Any) -> None:
        if not kwargs.keys() <= known:
            unknown = next(name for name in kwargs if name not in known)
            raise ParameterError(
                f"{type(self).__name__} has no parameter {unknown!r}; "
                f"{suggest_names(unknown, names, 'parameters')}"
            )
        function(self, *args, **kwargs)

    return __init__
