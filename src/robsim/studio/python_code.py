"""An experiment as Python code, as a person would write it, and its changes in one line."""

from __future__ import annotations

import pprint
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from robsim.base.errors import RobSimError
from robsim.declare.lists import get_item_label
from robsim.declare.short_numbers import shorten_numbers
from robsim.files import examples
from robsim.files.robot_library import describe_origin
from robsim.run.experiment import Experiment, load_scenario
from robsim.run.experiment_text import write_experiment

WIDTH = 96  # longest line of code
LONGEST_REMARK = 110  # characters
ELSEWHERE = "elsewhere/experiment.toml"  # a file in a folder without other files
LONGEST_VALUE = 40  # characters of a value in a remark


def format_python_code(experiment: Experiment) -> str:
    """Return Python code that builds and runs an experiment.

    The code loads the shipped scenario of the experiment and changes it. For another experiment it
    contains the text, so that it runs on any computer; it loads the file if the text refers to
    further files.

    >>> experiment = load_scenario(examples.path("visp_tutorial")).at("task.gain", 2)
    >>> print(format_python_code(experiment))
    import robsim as rs
    <BLANKLINE>
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial")).at({"task.gain": 2})
    run = experiment.run()
    rs.show(run)
    <BLANKLINE>
    """
    loads = _is_shipped(experiment) or not _stands_alone(experiment)
    building = (_format_loading_code(experiment) if loads else "") or _format_text_code(experiment)
    return f"import robsim as rs\n\n{building}\nrun = experiment.run()\nrs.show(run)\n"


def _is_shipped(experiment: Experiment) -> bool:
    """Return whether the file of an experiment is one of the package."""
    path = Path(experiment.source)
    known = bool(experiment.source) and path.stem in examples.names()
    return known and path.resolve() == Path(examples.path(path.stem)).resolve()


def _stands_alone(experiment: Experiment) -> bool:
    """Return whether the text of an experiment, without files of robots or meshes, builds it."""
    try:
        text = experiment.to_toml()
        return "filename" not in text and Experiment.from_text(text, ELSEWHERE) == experiment
    except RobSimError:
        return False


def format_change_remark(experiment: Experiment) -> str:
    """Return a comment line on the differences of an experiment from its file; "" without any.

    >>> experiment = load_scenario(examples.path("visp_tutorial"))
    >>> format_change_remark(experiment.at("task.gain", 2))
    '# visp_tutorial.toml with task.gain = 2\\n'
    """
    original = _load_original(experiment)
    changes = {} if original is None else find_changes(original, experiment)
    if not changes:
        return ""
    texts = [_describe_value(path, value) for path, value in changes.items()]
    start = f"# {Path(experiment.source).name} with"
    for count in range(len(texts), -1, -1):
        more = len(texts) - count
        rest = [f"{more} other value{'s' * (more > 1)}"] if more else []
        line = f"{start} {', '.join([*texts[:count], *rest])}"
        if len(line) <= LONGEST_REMARK:
            break
    return f"{line}\n"


def _describe_value(path: str, value: Any) -> str:
    """Return a changed value in words, such as "task.gain = 2"; without the value if it is long."""
    text = _format_literal(value)
    return f"{path} = {text}" if len(text) <= LONGEST_VALUE else f"another {path}"


def find_changes(before: Experiment, after: Experiment) -> dict[str, Any]:
    """Return the argument of `Experiment.at` that turns one experiment into another.

    >>> experiment = load_scenario(examples.path("visp_tutorial"))
    >>> find_changes(experiment, experiment.at("cameras.camera.focal", [810, 800]))
    {'cameras.camera.focal': [810, 800]}
    """
    old, new = _write_tables(before, False), _write_tables(after, False)
    added = {key: each for key, each in _write_tables(after, True).items() if key not in old}
    return dict(_yield_changes("", old, {**new, **added}))


def _write_tables(experiment: Experiment, brief: bool) -> Any:
    """Return all tables of an experiment, with short numbers; if `brief`, without defaults."""
    folder = Path(experiment.source).parent if experiment.source else Path()
    origin = partial(describe_origin, folder=folder)
    facts = {"short": True, "brief": brief, "read_origin": origin, "folder": folder}
    return shorten_numbers(write_experiment(experiment, **facts))


def _yield_changes(path: str, before: Any, after: Any) -> Iterator[tuple[str, Any]]:
    """Yield dotted names and new values of all differences within a table."""
    if "q" in after and "q" not in before:  # coordinates in place of a pose
        yield f"{path}q", after["q"]
        return
    for key in dict.fromkeys([*before, *after]):
        old, new, name = before.get(key), after.get(key), f"{path}{key}"
        if old == new:
            continue
        if old is None and (not path or path.startswith("belief.")):  # a new table, or new beliefs
            old = _make_empty_tables(new)
        if _is_changed_table(old, new):
            yield from _yield_changes(f"{name}.", old, new)
        elif (parts := _pair_items(old, new)) is not None:
            for label, (old_item, new_item) in parts.items():
                yield from _yield_changes(f"{name}.{label}.", old_item, new_item)
        else:
            yield name, new


def _make_empty_tables(new: Any) -> Any:
    """Return a table, or a list of named tables, without values, which changes can fill."""
    if isinstance(new, Mapping):
        return {key: new[key] for key in ("kind", "name") if key in new}
    return [_make_empty_tables(each) for each in new] if isinstance(new, list) else None


def _is_changed_table(old: Any, new: Any) -> bool:
    """Return whether two values are tables of the same kind."""
    tables = isinstance(old, Mapping) and isinstance(new, Mapping)
    return tables and old.get("kind") == new.get("kind")


def _pair_items(old: Any, new: Any) -> dict[str, tuple[Any, Any]] | None:
    """Return the tables of two lists by name if both lists have the same names; else None."""
    if not isinstance(old, list) or not isinstance(new, list) or len(old) != len(new):
        return None
    pairs = list(zip(old, new, strict=True))
    if not pairs or not all(_is_changed_table(*pair) for pair in pairs):
        return None
    names = [tuple(get_item_label(each, i) for each in pair) for i, pair in enumerate(pairs)]
    if any(first != second for first, second in names):
        return None
    return {str(name): pair for (name, _), pair in zip(names, pairs, strict=True)}


def _load_original(experiment: Experiment) -> Experiment | None:
    """Return the experiment of the file of an experiment; None without a valid file."""
    try:
        return load_scenario(experiment.source) if experiment.source else None
    except RobSimError:
        return None


def _format_loading_code(experiment: Experiment) -> str:
    """Return code that loads an experiment from its file and changes it; "" if it cannot."""
    original = _load_original(experiment)
    if original is None:
        return ""
    changes = {} if original == experiment else find_changes(original, experiment)
    try:
        if (original.at(changes) if changes else original) != experiment:
            return ""
    except RobSimError:
        return ""
    path, shipped = Path(experiment.source).resolve(), _is_shipped(experiment)
    location = f'rs.examples.path("{path.stem}")' if shipped else _format_literal(str(path))
    line = f"experiment = rs.load_scenario({location})"
    if not changes:
        return line
    short = f"{line}.at({_format_literal(changes)})"
    if len(short) <= WIDTH:
        return short
    items = (f"    {_format_literal(k)}: {_format_literal(x)}," for k, x in changes.items())
    return "\n".join([f"{line}.at({{", *items, "})"])


def _format_text_code(experiment: Experiment) -> str:
    """Return code that builds an experiment from its text, which stands between triple quotes."""
    text = format_change_remark(experiment) + experiment.to_toml()
    raw = "r" if "\\" in text else ""
    quoted = f'{raw}"""\n{text}"""'
    if '"""' in text:
        quoted = pprint.pformat(text, width=WIDTH)
    return f"experiment = rs.Experiment.from_text({quoted})"


def _format_literal(value: Any) -> str:
    """Return a value as Python code with double quotes."""
    if isinstance(value, Mapping):
        inside = (f"{_format_literal(k)}: {_format_literal(x)}" for k, x in value.items())
        return f"{{{', '.join(inside)}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_format_literal, value))}]"
    if isinstance(value, str) and "'" not in repr(value)[1:-1] and '"' not in value:
        return f'"{repr(value)[1:-1]}"'
    return repr(value)
