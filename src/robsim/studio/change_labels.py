"""Labels of buttons that change an experiment, in the words of a person."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from robsim.files.overrides import parse_toml_value

MOST = 3  # changes in a label
LONGEST = 44  # characters of a label with its value
NOUNS = {  # words for the last name of a path
    "interaction": "L",
    "dt": "period",
    "K": "intrinsics",
    "focal": "focal length",
    "dropped": "lost images",
    "rotvec": "rotation",
    "rpy": "angles",
}
KINDS = ("law", "variant", "projection", "weighting", "inverse", "form")  # as in "the joint law"
NO_CONTEXT = (
    "task",
    "sensing",
    "actuation",
    "run",
    "secondary",
)  # tables that a label does not mention
LISTS = ("robots", "objects", "cameras", "links", "tools", "phases", "tasks")
_WHOLE = re.compile(r"\b(\d+)\.0(?=\D|$)")  # a number such as 45.0


def describe_changes(changes: Mapping[str, Any]) -> str:
    """Return the words for changes at dotted names, as in "Try ...".

    >>> describe_changes({"task.interaction": "mean"})
    'L mean'
    >>> describe_changes({"task.kind": "pbvs"}), describe_changes({"sensing.latency": '"0 ms"'})
    ('PBVS', 'latency 0 ms')
    >>> describe_changes({"belief.cameras.eye.focal": 500, "run.duration": "45.0 s"})
    'believed focal length of eye: 500, duration 45 s'
    >>> describe_changes(dict.fromkeys(("sensing.noise", "task.gain", "run.dt", "run.seed"), 1))
    'noise 1, gain 1, and 2 more'
    >>> describe_changes({"task.weighting": [{"kind": "tukey", "noise": "1 px"}]})
    'the tukey weighting'
    """
    texts = [_describe_change(path, value) for path, value in changes.items()]
    if len(texts) > MOST:
        texts = [*texts[: MOST - 1], f"and {len(texts) - MOST + 1} more"]
    return ", ".join(texts)


def _describe_change(path: str, value: Any) -> str:
    """Return the words for one change; without its value if that is long."""
    name, text = _name_path(path.split(".")), _format_label_value(value)
    if path == "task.kind":
        return text.upper() if text in ("ibvs", "pbvs") else text
    if path in ("task.goal", "task.goal.computed"):
        return "a computed goal" if "computed" in f"{path} {text}" else "a shown goal"
    if value is None or text == "none":
        return f"no {name}"
    if name == "features":
        return f"{_read_kind(value)} as features"
    if name in KINDS and (kind := _read_kind(value)).isalpha():
        return f"the {kind} {name}"
    label = f"{name}{':' * (' of ' in name)} {text}"
    return label if len(label) <= LONGEST else f"another {name}"


def _read_kind(value: Any) -> str:
    """Return the kind of a value that is a word, a table, or a list with one of them."""
    value = parse_toml_value(value)
    if isinstance(value, list) and len(value) == 1:
        (value,) = value
    return _format_label_value(value.get("kind", "") if isinstance(value, Mapping) else value)


def _name_path(keys: list[str]) -> str:
    """Return a noun phrase for a dotted name, such as "believed focal length of eye"."""
    believed, leaf = keys[0] == "belief", keys[-1]
    middle = [key for key in keys[:-1] if key not in (*NO_CONTEXT, *LISTS, "belief", "to")]
    owners = [f"task {int(key) + 1}" if key.isdigit() else key for key in reversed(middle)]
    noun = NOUNS.get(leaf, leaf).replace("_", " ")
    phrase = " of ".join([noun, *(each.replace("_", " ") for each in owners)])
    return f"believed {phrase}" if believed else phrase


def _format_label_value(value: Any) -> str:
    """Return a value as a person writes it, without quotes and brackets."""
    value = parse_toml_value(value)
    if isinstance(value, Mapping):
        rest = ", ".join(
            f"{key} {_format_label_value(each)}" for key, each in value.items() if key != "kind"
        )
        return f"{value.get('kind', '')} {rest}".strip().replace("_", " ")
    if isinstance(value, list | tuple):
        return ", ".join(map(_format_label_value, value)) or "none"
    if isinstance(value, float):
        return f"{value:g}"
    return _WHOLE.sub(r"\1", str(value)).replace("_", " ")
