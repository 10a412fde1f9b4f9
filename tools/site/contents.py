"""The order of the pages on the site, read from docs/contents.toml."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
FILE = ROOT / "docs" / "contents.toml"


@dataclass(frozen=True)
class Group:
    """Pages for one purpose of a reader."""

    name: str
    title: str
    about: str
    pages: tuple[str, ...]


def read_groups() -> list[Group]:
    """Return the groups in their order."""
    tables = tomllib.loads(FILE.read_text(encoding="utf-8"))["groups"]
    return [Group(**{**table, "pages": tuple(table["pages"])}) for table in tables]


def read_reasons() -> dict[str, str]:
    """Return the reason for each page of more than 1,500 words."""
    return tomllib.loads(FILE.read_text(encoding="utf-8")).get("long", {})
