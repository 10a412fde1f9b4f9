"""Output of texts to terminals of any encoding."""

from __future__ import annotations

import sys

import click

LAYOUT = "\n\t"


def print_text(text: object, err: bool = False, nl: bool = True) -> None:
    """Print a text to stdout, or stderr if `err`, with escapes for unsupported characters."""
    stream = sys.stderr if err else sys.stdout
    click.echo(
        escape_unprintable(str(text), getattr(stream, "encoding", None) or "utf-8"), err=err, nl=nl
    )


def escape_unprintable(text: str, encoding: str) -> str:
    r"""Return a text with escapes for the characters that the encoding or a terminal cannot show.

    >>> print(escape_unprintable("5 \u03a9 \x1b[31m caf\u00e9", "latin-1"))
    5 \u03a9 \x1b[31m café
    """
    characters = (c if c.isprintable() or c in LAYOUT else ascii(c)[1:-1] for c in text)
    return "".join(characters).encode(encoding, "backslashreplace").decode(encoding)
