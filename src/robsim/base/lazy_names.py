"""Names that a package imports when they are first used, so that programs load only what they use.

The stub `__init__.pyi` of the package lists the names, as imports, for editors and type checkers.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any


def attach_names(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the functions `__getattr__` and `__dir__` of a package from its stub.

    Parameters
    ----------
    package : str
        Name of the package, its `__name__`.
    file : str
        File of the package, its `__file__`; the stub stands beside it.
    """
    sources = read_stub(Path(file).with_suffix(".pyi"))

    def import_name(name: str) -> Any:
        if name not in sources:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if sources[name] == package:
            return import_module(f"{package}.{name}")  # which sets the attribute
        value = getattr(import_module(sources[name]), name)
        setattr(import_module(package), name, value)  # the next access finds the attribute
        return value

    return import_name, lambda: list(sources)


def read_stub(stub: Path) -> dict[str, str]:
    """Return the module of each name that a stub imports.

    >>> import robsim
    >>> read_stub(Path(robsim.__file__).with_suffix(".pyi"))["Pose"]
    'robsim.geometry.pose'
    """
    tree = ast.parse(stub.read_text(encoding="utf-8"))
    imports = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    return {alias.name: str(node.module) for node in imports for alias in node.names}
