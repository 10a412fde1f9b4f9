"""Example scenarios, one TOML file each.

`robsim examples` lists the examples and copies them.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from robsim.base.errors import check_known


def names() -> tuple[str, ...]:
    """Return the names of the example scenarios.

    Returns
    -------
    tuple of str
        Names in alphabetical order.

    Examples
    --------
    >>> "chapter_6_1" in names()
    True
    """
    files = resources.files(__name__).iterdir()
    return tuple(sorted(Path(f.name).stem for f in files if f.name.endswith(".toml")))


def path(name: str) -> Path:
    """Return the path of an example scenario.

    Parameters
    ----------
    name : str
        Name of an example; see `names`.

    Returns
    -------
    pathlib.Path
        Path of the TOML file.

    Raises
    ------
    InputError
        If the example does not exist. The message lists all names.

    Examples
    --------
    >>> path("chapter_6_1").name
    'chapter_6_1.toml'
    """
    check_known(name, names(), "no example {}", "examples")
    return Path(str(resources.files(__name__) / f"{name}.toml"))
