"""YAML as plain tables, lists, numbers and texts: the extra `vision`.

PyYAML parses the text into events. Tags are ignored; aliases, duplicate keys and deep nesting are
rejected. This module parses numbers itself, because 1e-3 is a text in YAML 1.1.
"""

from __future__ import annotations

import re
from typing import Any

from robsim.base.errors import FileError, format_value

DEEPEST = 16
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_NAMED = re.compile(r"[-+]?\.(inf|nan)", re.IGNORECASE)
_VERSION = re.compile(r"\A%YAML[: ][^\n]*")  # OpenCV writes "%YAML:1.0", which is not valid YAML


def parse_yaml_table(text: str, source: str) -> Any:
    """Return the content of the only document of a YAML text; each number is a float.

    FileError is raised for invalid YAML, several documents, an alias, or a duplicate key.
    """
    try:
        import yaml
    except ImportError:
        raise FileError(f"{source}: YAML needs PyYAML: pip install 'robsim[vision]'") from None
    builder = _YamlBuilder(source)
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        for event in yaml.parse(_VERSION.sub("", text), Loader=loader):
            builder.add(type(event).__name__, event)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f":{mark.line + 1}" if mark else ""
        reason = getattr(error, "problem", None) or getattr(error, "reason", error)
        raise FileError(f"{source}{where}: not valid YAML: {reason!s:.200}") from None
    return builder.document


class _YamlBuilder:
    """A builder of the document from the events of the parser."""

    def __init__(self, source: str):
        self.source = source
        self.document: Any = None
        self.documents = 0
        self.open: list[Any] = []  # tables and lists that are not closed yet, the innermost last
        self.keys: list[str | None] = []  # for each of them, the key that has no value yet

    def add(self, kind: str, event: Any) -> None:
        """Process the next event."""
        if kind == "AliasEvent":
            self._refuse(event, f"the alias *{format_value(event.anchor)[1:-1]} is not allowed")
        elif kind == "ScalarEvent":
            self._store_value(event, _parse_scalar(event.value, event.style))
        elif kind in ("MappingStartEvent", "SequenceStartEvent"):
            value: Any = {} if kind.startswith("Mapping") else []
            self._store_value(event, value)
            self.open.append(value)
            self.keys.append(None)
            if len(self.open) > DEEPEST:
                self._refuse(event, f"nested more than {DEEPEST} deep")
        elif kind in ("MappingEndEvent", "SequenceEndEvent"):
            self.open.pop()
            self.keys.pop()

    def _store_value(self, event: Any, value: Any) -> None:
        """Store a value as the document, an item of a list, a key, or the value of a key."""
        if not self.open:
            self._begin(event, value)
        elif isinstance(self.open[-1], list):
            self.open[-1].append(value)
        elif self.keys[-1] is None:
            self.keys[-1] = self._key(event, value)
        else:
            self.open[-1][self.keys[-1]] = value
            self.keys[-1] = None

    def _begin(self, event: Any, value: Any) -> None:
        """Store the document; empty documents are ignored."""
        if value is not None:
            self.documents += 1
            self.document = value
        if self.documents > 1:
            self._refuse(event, "a second document; expected one")

    def _key(self, event: Any, value: Any) -> str:
        """Return a key that is new in its table."""
        if isinstance(value, dict | list):
            self._refuse(event, "a key must be a text")
        if event.value in self.open[-1]:
            self._refuse(event, f"the key {format_value(event.value)} occurs twice")
        return str(event.value)

    def _refuse(self, event: Any, text: str) -> None:
        """Raise FileError with the line of an event."""
        raise FileError(f"{self.source}:{event.start_mark.line + 1}: {text}")


def _parse_scalar(text: str, style: str | None) -> float | str | None:
    """Return the value of a scalar; quoted scalars are texts."""
    if style in ("'", '"'):
        return text
    if text in ("", "~", "null"):
        return None
    return parse_plain_scalar(text)


def parse_plain_scalar(text: str) -> float | str:
    """Return the number that an unquoted text represents, or the text.

    >>> [parse_plain_scalar(text) for text in ("1e-3", "320.", "-.Inf", "1:30")]
    [0.001, 320.0, -inf, '1:30']
    """
    if _NUMBER.fullmatch(text):
        return float(text)
    return float(text.replace(".", "").lower()) if _NAMED.fullmatch(text) else text
