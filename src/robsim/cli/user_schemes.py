"""Schemes in Python files that the user names on the command line, which are run."""

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
    """Return what each FILE.py:NAME names, by "file:NAME"; InputError or FileError says which."""
    found: dict[str, Any] = {}
    for text in texts:
        path, colon, name = text.rpartition(":")
        if not (path and colon and name.isidentifier()):
            raise InputError(f"--task: expected FILE.py:NAME, as in mine.py:Scheme, got {text!r}")
        label = f"{Path(path).stem}:{name}"
        if label in found:
            raise InputError(f"--task: two schemes are called {label}; rename a file")
        found[label] = _find_in_module(_load_module(Path(path)), name, path)
    return found


def _load_module(file: Path) -> ModuleType:
    """Return the module of a file, in whose folder it finds others; FileError if it fails."""
    from robsim.suites.builtin_schemes import format_user_error

    if not path_exists(file) or file.is_dir():
        raise FileError(f"--task: {file}: no such file")
    name = f"_robsim_bench_{file.stem}"  # so that it hides no module
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
    """Return what has a name in a module; InputError tells the nearest that is its own."""
    if hasattr(module, name):
        return getattr(module, name)
    own = [
        key
        for key, value in vars(module).items()
        if not key.startswith("_") and getattr(value, "__module__", None) == module.__name__
    ]
    raise InputError(f"--task: no {name!r} in {path}; {suggest_names(name, own, 'there are')}")
