"""The remark at the head of a scenario file, and the commands in it."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import takewhile

_COMMAND = "robsim "  # first word of a line with a command


@dataclass(frozen=True)
class RemarkEntry:
    """A sentence of a remark, and the commands that belong to it.

    The first entry of a remark describes the experiment and has no commands.
    """

    sentence: str
    commands: tuple[str, ...] = ()


def extract_remark(text: str) -> str:
    """Return the remark at the head of a scenario file; only indented lines remain separate.

    >>> extract_remark("# A square.\\n# Watch it.\\n#   robsim run x.toml\\nschema = 1\\n# no")
    'A square. Watch it.\\nrobsim run x.toml'
    """
    lines = [line for line in text.splitlines() if not line.startswith("#:")]
    head = [line[1:] for line in takewhile(lambda line: line.startswith("#"), lines)]
    text_of_head = "".join(("\n" if line.startswith("  ") else " ") + line.strip() for line in head)
    return text_of_head.strip()


def list_remark_entries(remark: str) -> list[RemarkEntry]:
    """Return the sentences of a remark with their commands.

    >>> list_remark_entries("A square.\\nFaster:\\nrobsim run x.toml --set task.gain=2")[1]
    RemarkEntry(sentence='Faster:', commands=('robsim run x.toml --set task.gain=2',))
    """
    entries: list[RemarkEntry] = []
    for line in filter(None, remark.split("\n")):
        if line.startswith(_COMMAND) and entries:
            last = entries.pop()
            entries.append(RemarkEntry(last.sentence, (*last.commands, line)))
        else:
            entries.append(RemarkEntry(line))
    return entries


def parse_run_command(command: str, name: str) -> Mapping[str, str]:
    """Return the changes of a command that runs an experiment; {} for any other command.

    `name` is the name of the experiment.

    >>> parse_run_command("robsim run x.toml --set task.gain=2", "x")
    {'task.gain': '2'}
    """
    words = _split_command(command)
    if words[:3] != ["robsim", "run", f"{name}.toml"] or not set(words[3::2]) <= {"--set"}:
        return {}
    return dict(_split_change(change) for change in words[4::2])


def parse_compare_command(command: str, name: str) -> tuple[str, list[str]]:
    """Return the varied name and the values of a comparison; no values for any other command.

    >>> parse_compare_command("robsim compare x.toml --vary task.kind=ibvs,pbvs", "x")
    ('task.kind', ['ibvs', 'pbvs'])
    """
    words = _split_command(command)
    if words[:3] != ["robsim", "compare", f"{name}.toml"] or words[3:-1] != ["--vary"]:
        return "", []
    path, values = _split_change(words[4])
    return path, values.split(",")


def _split_command(command: str) -> list[str]:
    """Return the words of a command; none if its quotes do not match."""
    try:
        return shlex.split(command)
    except ValueError:
        return []


def _split_change(change: str) -> tuple[str, str]:
    """Return the name and the text of the value of a change."""
    path, _, value = change.partition("=")
    return path.strip(), value.strip()
