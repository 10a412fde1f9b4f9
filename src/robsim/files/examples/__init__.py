"""Example scenarios, one TOML file each; `robsim examples` lists them and copies them out."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from robsim.base.errors import check_known


def names() -> tuple[str, ...]:
    """Return the names of the examples that come with RobSim.

    >>> "chapter_6_1" in names()
    True
    """
    files = resources.files(__name__).iterdir()
    return tuple(sorted(Path(f.name).stem for f in files if f.name.endswith(".toml")))


def path(name: str) -> Path:
    """Return the file of an example. InputError: there is none of that name."""
    check_known(name, names(), "no example {}", "examples")
    return Path(str(resources.files(__name__) / f"{name}.toml"))
