"""Summaries of an experiment, as lines of text and as a table for notebooks."""

from __future__ import annotations

import re
from dataclasses import MISSING, fields
from typing import Any

import numpy as np

from robsim.base import html
from robsim.base.value import make_hashable
from robsim.world import scene_overview

WIDTH = 160  # characters of one line


def format_experiment(experiment: Any) -> str:
    """Return a line for the scene, the task, and each setting that is not its default."""
    title = f" {experiment.title!r}" if experiment.title else ""
    names = ", ".join(
        f"{kind} {name!r}" for kind, name, *_ in scene_overview._list_parts(experiment.scene)
    )
    rows = [("scene", names or "empty"), *_list_settings(experiment)]
    lines = [f"{name:<10} {value[:WIDTH]}" for name, value in rows]
    return "\n  ".join([f"<Experiment{title}", *lines]) + ">"


def format_experiment_html(experiment: Any) -> str:
    """Return an HTML table of the scene, the task and the settings."""
    things = [
        (kind, f"{name} on {on}: {details}")
        for kind, name, on, details in scene_overview._list_parts(experiment.scene)
    ]
    return html.format_html_table(
        experiment.title or "Experiment", [*things, *_list_settings(experiment)]
    )


def _list_settings(experiment: Any) -> list[tuple[str, str]]:
    """Return names and values of the task, the start, the duration and changed settings."""
    start = experiment.start
    alone = start is None or start.ndim == 1
    starts = (
        "home" if start is None else format_brief_value(start) if alone else f"{len(start)} starts"
    )
    rows = [("task", format_brief_value(experiment.task)), ("start", starts)]
    rows.append(("duration", f"{experiment.duration:g} s in periods of {experiment.dt:g} s"))
    for each in fields(experiment):
        value = getattr(experiment, each.name)
        apart = ("scene", "task", "start", "dt", "duration", "title", "varied", "study", "source")
        if each.name not in apart and value != each.default:
            rows.append((each.name, format_brief_value(value)))
    if experiment.varied:
        rows.append(("varied", f"in {experiment.runs} runs {', '.join(experiment.varied)}"))
    return rows


def format_brief_value(value: Any) -> str:
    """Return a value in one line; of a dataclass, only fields that are not their defaults.

    >>> from robsim import IBVS
    >>> format_brief_value(IBVS(gain=2.0))
    'IBVS(gain=2.0)'
    """
    if not hasattr(value, "__dataclass_fields__"):
        plain = np.round(value, 4).tolist() if isinstance(value, np.ndarray) else value
        return re.sub(r"\s+", " ", repr(plain))
    plain = _make_default_object(type(value))
    changed = [
        f"{each.name}={format_brief_value(getattr(value, each.name))}"
        for each in fields(value)
        if each.repr
        and make_hashable(getattr(value, each.name))
        != make_hashable(getattr(plain, each.name, None))
    ]
    return f"{type(value).__name__}({', '.join(changed)})"


def _make_default_object(kind: type[Any]) -> Any:
    """Return a default instance of a class; None if the class has required arguments."""
    needed = (f.default is MISSING and f.default_factory is MISSING for f in fields(kind) if f.init)
    return None if any(needed) else kind()
