"""The suites by name; each module in the package `published` is a suite."""

from __future__ import annotations

import importlib
import pkgutil

from robsim.base.errors import InputError, format_value, is_known_name, suggest_names
from robsim.suites import published
from robsim.suites.reproduction import Reproduction
from robsim.suites.suite import Suite


def list_suites() -> tuple[str, ...]:
    """Return the names of the suites.

    >>> "cns_150" in list_suites()
    True
    """
    return tuple(sorted(each.name for each in pkgutil.iter_modules(published.__path__)))


def load_quick_suites() -> list[Suite | Reproduction]:
    """Return the suites without pictures, which are the suites that run if none is named.

    >>> "vit_500_images" in [each.name for each in load_quick_suites()]
    False
    """
    every = map(load_suite, list_suites())
    return [each for each in every if isinstance(each, Reproduction) or not each.uses_pictures]


def load_suite(name: str) -> Suite | Reproduction:
    """Return a suite by its name; raise InputError with the nearest name if it does not exist."""
    if not is_known_name(name, list_suites()):
        raise InputError(
            f"no suite {format_value(name)}; {suggest_names(name, list_suites(), 'suites')}"
        )
    suite: Suite | Reproduction = importlib.import_module(f"{published.__name__}.{name}").suite()
    return suite
