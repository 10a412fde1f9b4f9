"""The suites by name: a file in the folder `published` is all that a new one needs."""

from __future__ import annotations

import importlib
import pkgutil
from typing import Any

from robsim.base.errors import InputError, is_one_of, said, suggest
from robsim.suites import published


def names() -> tuple[str, ...]:
    """Return the names of the suites.

    >>> "cns_150" in names()
    True
    """
    return tuple(sorted(each.name for each in pkgutil.iter_modules(published.__path__)))


def suite_of(name: str) -> Any:
    """Return the suite of a name. InputError: there is none of that name, with the nearest."""
    if not is_one_of(name, names()):
        raise InputError(f"no suite {said(name)}; {suggest(name, names(), 'suites')}")
    return importlib.import_module(f"{published.__name__}.{name}").suite()
