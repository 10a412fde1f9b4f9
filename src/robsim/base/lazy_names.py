"""Names that a package imports when they are first used, so that programs load only what they use.

The stub `__init__.pyi` of the package lists the names, as imports, for editors and type checkers.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from robsim.base.environment import check_numba_variables

ROOT = Path(__file__).parents[1]


def attach_names(
    package: str, file: str
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return `__getattr__`, `__dir__` and `__all__` of a package, from its stub.

    Parameters
    ----------
    package : str
        Name of the package, its `__name__`.
    file : str
        File of the package, its `__file__`; the stub stands beside it.
    """
    sources = read_imports(Path(file).with_suffix(".pyi"))

    def import_name(name: str) -> Any:
        if name not in sources:
            hint = "" if name.startswith("_") else _describe_place(name)
            raise AttributeError(f"module {package!r} has no attribute {name!r}{hint}")
        check_numba_variables()  # before an import of Numba, which raises other errors
        if sources[name] == package:
            return import_module(f"{package}.{name}")  # which sets the attribute
        value = getattr(import_module(sources[name]), name)
        setattr(import_module(package), name, value)  # the next access finds the attribute
        return value

    return import_name, lambda: list(sources), list(sources)


def read_imports(path: Path) -> dict[str, str]:
    """Return the module of each name that a stub or a module imports.

    >>> read_imports(ROOT / "__init__.pyi")["Pose"]
    'robsim.geometry.pose'
    """
    tree = ast.parse(path.read_text(encoding="utf-8"))
    imports = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    return {alias.name: str(node.module) for node in imports for alias in node.names}


def _describe_place(name: str) -> str:
    """Return "; it is rs.samplers.Uniform" for a name of a public module, else nothing."""
    modules = {path.parent.name: path for path in ROOT.glob("*/__init__.pyi")}
    modules |= {path.stem: path for path in ROOT.glob("*.py") if path.stem != "__init__"}
    for module, path in sorted(modules.items()):
        if f" import {name} as {name}\n" in path.read_text(encoding="utf-8"):
            return f"; it is rs.{module}.{name} (import robsim as rs)"
    return ""
