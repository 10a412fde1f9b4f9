"""An experiment in short: as a few lines of text, and as a table for notebooks."""

from __future__ import annotations

import re
from dataclasses import MISSING, fields
from typing import Any

import numpy as np

from robsim.base import html
from robsim.base.values import hashable
from robsim.world import overview

WIDTH = 160  # characters of one line


def text(experiment: Any) -> str:
    """Return a line for the scene, the task, and each setting that is not its default."""
    title = f" {experiment.title!r}" if experiment.title else ""
    names = ", ".join(f"{kind} {name!r}" for kind, name, *_ in overview.rows(experiment.scene))
    rows = [("scene", names or "empty"), *_rows(experiment)]
    lines = [f"{name:<10} {value[:WIDTH]}" for name, value in rows]
    return "\n  ".join([f"<Experiment{title}", *lines]) + ">"


def table(experiment: Any) -> str:
    """Return a table as HTML: what is in the scene, the task and the settings."""
    things = [
        (kind, f"{name} on {on}: {what}")
        for kind, name, on, what in overview.rows(experiment.scene)
    ]
    return html.table(experiment.title or "Experiment", [*things, *_rows(experiment)])


def _rows(experiment: Any) -> list[tuple[str, str]]:
    """Return name and value of the task, the start, the duration and changed settings."""
    start = experiment.start
    alone = start is None or start.ndim == 1
    starts = "home" if start is None else brief(start) if alone else f"{len(start)} starts"
    rows = [("task", brief(experiment.task)), ("start", starts)]
    rows.append(("duration", f"{experiment.duration:g} s in periods of {experiment.dt:g} s"))
    for each in fields(experiment):
        value = getattr(experiment, each.name)
        apart = ("scene", "task", "start", "dt", "duration", "title", "varied", "study", "source")
        if each.name not in apart and value != each.default:
            rows.append((each.name, brief(value)))
    if experiment.varied:
        rows.append(("varied", f"in {experiment.runs} runs {', '.join(experiment.varied)}"))
    return rows


def brief(value: Any) -> str:
    """Return a value in one line; of a dataclass only what is not its default.

    >>> from robsim import IBVS
    >>> brief(IBVS(gain=2.0))
    'IBVS(gain=2.0)'
    """
    if not hasattr(value, "__dataclass_fields__"):
        plain = np.round(value, 4).tolist() if isinstance(value, np.ndarray) else value
        return re.sub(r"\s+", " ", repr(plain))
    plain = _plain(type(value))
    changed = [
        f"{each.name}={brief(getattr(value, each.name))}"
        for each in fields(value)
        if each.repr
        and hashable(getattr(value, each.name)) != hashable(getattr(plain, each.name, None))
    ]
    return f"{type(value).__name__}({', '.join(changed)})"


def _plain(kind: type[Any]) -> Any:
    """Return what the class makes of no arguments; None where it needs some."""
    needed = (f.default is MISSING and f.default_factory is MISSING for f in fields(kind) if f.init)
    return None if any(needed) else kind()
