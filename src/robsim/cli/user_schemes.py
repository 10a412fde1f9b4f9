"""Loading of schemes from Python files of the user."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

from robsim.base.errors import FileError, InputError, suggest_names
from robsim.cli.output_files import path_exists


def load_user_schemes(texts: Sequence[str]) -> dict[str, Any]:
    """Return the schemes of texts FILE.py:NAME, by "FILE:NAME".

    Raise InputError or FileError if a text, a file or a name is invalid.
    """
    schemes: dict[str, Any] = {}
    for text in texts:
        path, colon, name = text.rpartition(":")
        if not (path and colon and name.isidentifier()):
            raise InputError(f"--task: expected FILE.py:NAME, as in mine.py:Scheme, got {text!r}")
        label = f"{Path(path).stem}:{name}"
        if label in schemes:
            raise InputError(f"--task: two schemes have the name {label}; rename a file")
        schemes[label] = _find_in_module(_load_module(Path(path)), name, path)
    return schemes


def _load_module(file: Path) -> ModuleType:
    """Return the module of a file; raise FileError on failure. It can import from its folder."""
    from robsim.suites.builtin_schemes import format_user_error

    if not path_exists(file) or file.is_dir():
        raise FileError(f"--task: {file}: no such file")
    name = f"_robsim_bench_{file.stem}"  # does not hide another module
    spec = spec_from_file_location(name, file.resolve())
    if spec is None or spec.loader is None:
        raise FileError(f"--task: {file}: not a Python file, NAME.py")
    module = sys.modules[name] = module_from_spec(spec)
    sys.path.insert(0, str(file.resolve().parent))
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        raise FileError(f"--task: {file}, line {error.lineno}: {error.msg}") from error
    except (Exception, SystemExit) as error:
        raise FileError(f"--task: {file} {format_user_error(error)}") from error
    finally:
        sys.path.pop(0)
    return module


def _find_in_module(module: ModuleType, name: str, path: str) -> Any:
    """Return an object of a module; raise InputError with the nearest name if it is missing."""
    if hasattr(module, name):
        return getattr(module, name)
    own = [key for key, value in vars(module).items() if _is_own_scheme(key, value, module)]
    raise InputError(f"--task: no {name!r} in {path}; {suggest_names(name, own, 'there are')}")


def _is_own_scheme(name: str, value: Any, module: ModuleType) -> bool:
    """Return whether a module defines a task, or a class or function that may return one."""
    from robsim.servo.tasks.task import Task

    if name.startswith("_"):
        return False
    if not isinstance(value, type) and isinstance(value, Task):
        return True
    return callable(value) and getattr(value, "__module__", None) == module.__name__
