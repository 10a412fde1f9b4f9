"""RobSim: model, simulate and see robots that are guided by cameras.

>>> from robsim import Pose
>>> Pose.at(0, 0, 1).position
array([0., 0., 1.])
"""

import ast
import importlib
import sys
from pathlib import Path
from typing import Any

__version__ = "0.1.0"


def _sources() -> dict[str, str]:
    """Return the module of each public name, from the imports that `__init__.pyi` lists."""
    stub = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    imports = [node for node in ast.parse(stub).body if isinstance(node, ast.ImportFrom)]
    return {alias.name: str(node.module) for node in imports for alias in node.names}


_SOURCES = _sources()
__all__ = list(_SOURCES)


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that programs load what they use."""
    if name not in _SOURCES:
        raise AttributeError(f"module 'robsim' has no attribute {name!r}")
    if _SOURCES[name] == __name__:
        found = importlib.import_module(f"{__name__}.{name}")
    else:
        found = getattr(__import__(_SOURCES[name], fromlist=[name]), name)
    globals()[name] = found  # so that this is asked once
    return found


def __dir__() -> list[str]:
    """Return the public names: classes, functions, and the modules that are doors."""
    return __all__


_SHOWN = {
    "files.table": "Run",
    "run.mission_run": "MissionRun",
    "world.scene": "Scene",
    "robot.robot": "Robot",
}


def _shown_in_notebooks() -> None:
    """Let IPython, where it runs, show runs, scenes and robots as the page of `export_html`."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    if shell is None:
        return
    html = shell.display_formatter.formatters["text/html"]
    for module, name in _SHOWN.items():
        html.for_type_by_name(f"{__name__}.{module}", name, _page)


def _page(shown: Any) -> str:
    found: str = importlib.import_module(f"{__name__}.page.export").in_cell(shown)
    return found


_shown_in_notebooks()
