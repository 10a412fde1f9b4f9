"""Scenarios with parts missing, moved, repeated, misspelt, or of odd sizes and kinds."""

from __future__ import annotations

import copy
import json
import random
import re
import time
import tomllib
import warnings
from collections.abc import Sequence

import tomli_w
from attack.harness import Wrong

from robsim import Experiment, examples
from robsim.base import errors
from robsim.errors import InputError
from robsim.run.experiment_text import ExperimentTable, get_table_keys

NAME = "toml_mutants"
LONGEST = 2.0  # seconds of the processor for any refusal
RUNS, WRITTEN = 0.05, 0.1  # shares of the scenarios taken that are run, and read again
TABLES = {*get_table_keys(ExperimentTable), "schema"}
NO_KEY = re.compile(r"line \d+|<text>: (and \d+ more|empty|larger than)")
KEY = re.compile(r"<text>: ([\w-]+)(\[\d+\]|\.\S|:)")
NUMBERS = ["0", "-0.0", "-1", "nan", "inf", "-inf", "1e308", "1e-320", "1e9", "true", "1e19"]
NUMBERS += ["65", "0.5", "1_0", "1979-05-27", "2e9999"]
NUMBERS += ["9" * 5000, "0x" + "f" * 5000]
LETTERS = ["\u00a0", "\ufeff", "\u2028", "\x1b[31m", "\u03a9", "\ud7ff", "\U0001f4a5", "\u202e"]
LETTERS += list("\"'[]{}=.#\\\n\r\t,-\x7f\x00\u0663")
ODD = [0, -1, 2.5, True, "", "x", "home", "world", [], {}, [[]], [{}], {"kind": "x"}, "90 deg"]
ODD += ["nan m", "1e400 m", "-1 px", 2**63 - 1, float("nan"), float("inf"), 1e308, 5e-324, "\x00"]
ODD += ["x" * 100_000, [0] * 1000, ["0, 0, 1 m"] * 5000, "0, 0, 0", "1e9 m", "0 s", "3 parsecs"]


def case(seed: int) -> bool:
    """Read and check one mutant; an accepted one is sometimes run, or written and read again."""
    rng = random.Random(seed)
    text = mutant(rng)
    if not _checked(text):
        return False
    if rng.random() < RUNS:
        return _run(text)
    if rng.random() < WRITTEN:
        _written(text)
    return True


def mutant(rng: random.Random) -> str:
    """Return a shipped scenario with one to three changes."""
    text = _example(rng)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        change = rng.choice(IN_TEXT if rng.random() < 0.4 else IN_TABLES)
        if change in IN_TEXT:
            text = change(rng, text)
            continue
        try:
            text = _text(change(rng, tomllib.loads(text)), rng.random() < 0.3)
        except (ValueError, RecursionError):  # no TOML any more, or a number too long to write
            return text
    return text


def _text(tables, inline: bool) -> str:
    """Return the text of tables; the task may be an inline table."""
    first = {key: tables[key] for key in ("task",) if inline and key in tables}
    rest = {key: part for key, part in tables.items() if key not in first}
    return "".join(f"{key} = {_inline(part)}\n" for key, part in first.items()) + tomli_w.dumps(
        rest
    )


def _inline(value) -> str:
    if isinstance(value, dict):
        return f"{{{', '.join(f'{json.dumps(k)} = {_inline(x)}' for k, x in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_inline, value))}]"
    return json.dumps(value) if isinstance(value, str | bool) else str(value)


def _checked(text: str) -> bool:
    """Return whether a text is taken; Wrong: no key is named, or that takes long, twice."""
    message = None
    for _ in range(2):  # the first time may compile, or load
        begin = time.process_time()
        try:
            _silent(lambda: Experiment.from_text(text).check())
        except InputError as error:
            message = str(error)
        took = time.process_time() - begin
        if took <= LONGEST:
            break
    else:
        raise Wrong(f"{took:.1f} s until {message or 'it was taken'!r:.300}")
    _check_named(message)
    return message is None


def _check_named(message: str | None) -> None:
    """Raise Wrong unless every line of a refusal names a key, or a line of the text."""
    for line in (message or "").split("\n")[: 0 if message is None else None]:
        key = KEY.match(line)
        known = key and (key[1] in TABLES or "unknown key" in line)
        if not known and not NO_KEY.search(line):
            raise Wrong(f"names no key: {line:.300}")


def _run(text: str) -> bool:
    """Return whether two periods of a scenario are simulated, or named as impossible."""
    experiment = Experiment.from_text(text)
    try:
        _silent(lambda: experiment.with_(duration=2 * experiment.dt).run(threads=1))
    except InputError as error:
        _check_named(str(error))
        return False
    return True


def _written(text: str) -> None:
    """Raise Wrong unless the exact text of a scenario gives the same scenario."""
    experiment = _silent(lambda: Experiment.from_text(text))
    if _silent(lambda: Experiment.from_text(experiment.to_toml())) != experiment:
        raise Wrong("the text that it writes says something else")


def _silent(do):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for own in (errors.RankWarning, errors.UnitWarning, errors.FileWarning):
            warnings.simplefilter("ignore", own)
        return do()


def _example(rng: random.Random) -> str:
    return examples.path(rng.choice(examples.names())).read_text(encoding="utf-8")


def lines(rng: random.Random, text: str) -> str:
    """Delete, repeat or swap lines."""
    lines = text.split("\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    how = rng.randrange(4)
    if how == 0:
        del lines[i]
    elif how == 1:
        lines.insert(j, lines[i])
    elif how == 2:
        lines[i], lines[j] = lines[j], lines[i]
    else:
        del lines[i:]
    return "\n".join(lines)


def letters(rng: random.Random, text: str, odd: Sequence[str] = LETTERS) -> str:
    """Put in, take out or swap some letters."""
    for _ in range(rng.randint(1, 3)):
        i = rng.randrange(len(text) + 1)
        put = rng.choice([*odd, "", text[i + 1 : i + 2] + text[i : i + 1]])
        text = text[:i] + put + text[i + rng.choice((0, 1, 2)) :]
    return text


def _number(rng: random.Random, text: str) -> str:
    """Replace a number by an odd one, or take its unit away."""
    found = list(re.finditer(r"-?\b\d+(\.\d+)?( [a-z/]+)?", text))
    if not found:
        return text
    one = rng.choice(found)
    new = one[0].split(" ")[0] if one[2] and rng.random() < 0.3 else rng.choice(NUMBERS)
    return text[: one.start()] + new + (one[2] or "") * rng.randrange(2) + text[one.end() :]


def _places(node, path=()):
    """Yield the path of every value."""
    inside = node.items() if isinstance(node, dict) else enumerate(node)
    for key, value in inside:
        yield (*path, key)
        if isinstance(value, dict | list):
            yield from _places(value, (*path, key))


def _picked(rng: random.Random, tables):
    """Return the container of some value, and its key there."""
    places = list(_places(tables))
    *path, key = rng.choice(places) if places else ("schema",)
    for each in path:
        tables = tables[each]
    return tables, key


def _odd(rng: random.Random, tables):
    """Put something odd in the place of a value."""
    owner, key = _picked(rng, tables)
    if owner:
        owner[key] = copy.deepcopy(rng.choice(ODD))
    return tables


def _gone(rng: random.Random, tables):
    """Take a value away."""
    owner, key = _picked(rng, tables)
    if owner:
        del owner[key]
    return tables


def _misspelt(rng: random.Random, tables):
    """Misspell a key, or a text that is a value."""
    owner, key = _picked(rng, tables)
    wrong = "".join(rng.sample(str(key), len(str(key)))) if rng.random() < 0.3 else f"{key}s"
    if isinstance(owner, dict) and owner and rng.random() < 0.5:
        owner[wrong] = owner.pop(key)
    elif owner and isinstance(owner[key], str) and owner[key]:
        owner[key] = owner[key][:-1] + rng.choice(["", "x", " ", "é"])
    return tables


def _moved(rng: random.Random, tables):
    """Put a value of this or another scenario in another place."""
    source = tables if rng.random() < 0.5 else tomllib.loads(_example(rng))
    (a, i), (b, j) = _picked(rng, tables), _picked(rng, source)
    if a and b:
        new = copy.deepcopy(b[j])
        a[i if isinstance(a, list) else rng.choice([i, j if isinstance(j, str) else i])] = new
    return tables


def _repeated(rng: random.Random, tables):
    """Repeat the things of a list, under their names or under others."""
    owner, key = _picked(rng, tables)
    lists = [k for k, v in tables.items() if isinstance(v, list)]
    if lists and rng.random() < 0.5:
        owner, key = tables, rng.choice(lists)
    if owner and isinstance(owner[key], list) and owner[key]:
        one = owner[key][0]
        count = rng.choice((2, 2, 3, 70, 1 + 10**6 // (50 + len(repr(one)))))
        named = isinstance(one, dict) and "name" in one and rng.random() < 0.7
        owner[key] = [{**one, "name": f"n{i}"} if named else one for i in range(count)]
    return tables


def _nested(rng: random.Random, tables):
    """Put a value, or the task, into others of its kind."""
    task = tables.get("task")
    if isinstance(task, dict) and rng.random() < 0.7:
        tables["task"] = _tree(rng, task, rng.choice((1, 2, 5, 9, 30, 70)))
        return tables
    owner, key = _picked(rng, tables)
    for _ in range(rng.choice((1, 3, 60)) if owner else 0):
        owner[key] = [owner[key]] if rng.random() < 0.5 else {str(key): owner[key]}
    return tables


def _tree(rng: random.Random, task, depth: int):
    """Return tasks of tasks, which have two branches while there are few."""
    kind, one = rng.choice(("switch", "switch", "parallel", "priorities")), task
    for _ in range(depth):
        other = task if len(repr(task)) < 30_000 else one
        if kind == "switch":
            when = {"kind": "error_below", "value": 0.1}
            task = {"kind": kind, "first": task, "second": other, "when": when}
        else:
            task = {"kind": kind, "tasks": [task, other]}
    return task


def _believed(rng: random.Random, tables):
    """Add a belief about some parts, once or twice, true or not."""
    kinds = [k for k in ("robots", "objects", "cameras") if isinstance(tables.get(k), list)]
    if kinds:
        kind = rng.choice(kinds)
        parts = [p for p in tables[kind] if isinstance(p, dict)]
        believed = [copy.deepcopy(rng.choice(parts)) for _ in range(rng.randint(1, 3)) if parts]
        tables["belief"] = {kind: believed, **({"complete": True} if rng.random() < 0.2 else {})}
    return tables


IN_TEXT = [lines, letters, _number]
IN_TABLES = [_odd, _odd, _gone, _misspelt, _moved, _moved, _repeated, _nested, _believed]
