"""Example scenarios, one TOML file each; `robsim examples` lists them and copies them out."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from robsim.base.errors import InputError, is_one_of, said, suggest


def names() -> tuple[str, ...]:
    """Return the names of the examples that come with RobSim.

    >>> "chapter_6_1" in names()
    True
    """
    files = resources.files(__name__).iterdir()
    return tuple(sorted(Path(f.name).stem for f in files if f.name.endswith(".toml")))


def path(name: str) -> Path:
    """Return the file of an example. InputError: there is none of that name."""
    if not is_one_of(name, names()):
        raise InputError(f"no example {said(name)}; {suggest(name, names(), 'examples')}")
    return Path(str(resources.files(__name__) / f"{name}.toml"))
