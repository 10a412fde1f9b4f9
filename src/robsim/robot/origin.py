"""The library robot or the file that a robot was read from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from robsim.declare.spec import MISSING, Context, Live, Raw, Spec


@dataclass(frozen=True)
class Origin:
    """The name of a library robot, or the absolute path of a URDF file."""

    model: str | None = None
    urdf: str | None = None


KEYS = {
    "model": "The name of a robot of the library.",
    "urdf": "The path of a URDF file from here.",
}


@dataclass(frozen=True)
class OriginKeys(Spec):
    """The declaration of the keys `model` and `urdf`, whose links stand in the table already."""

    def pick(self, table: Mapping[str, Raw], name: str, c: Context) -> Any:
        """Return the origin of a table of links; MISSING where they are all its own."""
        given = [table[key] for key in KEYS if key in table]
        return given[0].value if given and isinstance(given[0], Live) else MISSING

    def put(self, table: dict[str, Raw], name: str, value: Any, c: Context) -> None:
        """Keep the origin beside the links, which are written in full; no text can say both."""
        if value is not None and c.facts.get("live"):
            table["model"] = Live(value)

    def keys(self, name: str) -> tuple[str, ...]:
        """Return the two keys, of which a table has at most one."""
        return tuple(KEYS)

    def words(self) -> str:
        """Return the expected value as a phrase."""
        return "a text"

    def properties(self, name: str, define: Any) -> dict[str, Any]:
        """Return the JSON Schema of both keys."""
        return {key: {"type": "string", "description": about} for key, about in KEYS.items()}

    def rows(self, name: str) -> list[tuple[str, str]]:
        """Return nothing: the documentation speaks of both keys above the table."""
        return []
