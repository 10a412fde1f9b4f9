"""What a server shows: the part of a studio that knows nothing of HTTP and WebSocket."""

from __future__ import annotations

from typing import Any, Protocol


class UnavailableDownload(Exception):
    """The error of an app whose words go to the page."""


class App(Protocol):
    """What a server shows: a page, files for download, and a conversation with each page.

    The server calls `page` and `download` in threads of their own, also several at once, and
    `hello` and `receive` in its one thread, which serves all pages: these two return at once.
    """

    def page(self) -> str:
        """Return the HTML text, whose policy stands in a meta element."""
        ...

    def download(self, name: str) -> tuple[str, bytes] | None:
        """Return media type and content of a file such as "run.nc"; None where there is none.

        Unavailable: why there is none now, in words for a person.
        """
        ...

    def hello(self) -> list[str | bytes]:
        """Return what brings a page to the present that connects, or that fell behind.

        What is broadcast while this is at work may reach that page once more after it.
        """
        ...

    def receive(self, message: dict[str, Any]) -> str | None:
        """Take one JSON object from a page; return an answer for that page alone, if any.

        All its numbers are finite, and it nests at most 16 deep. What the server says of a
        message itself is a JSON object, too: {"error": "what is wrong, in words"}.
        """
        ...
