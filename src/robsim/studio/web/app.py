"""Interface between the server and the app that it shows, without HTTP and WebSocket."""

from __future__ import annotations

from typing import Any, Protocol


class UnavailableDownload(Exception):
    """An error of an app; its message is sent to the page."""


class App(Protocol):
    """An app shown by a server: a page, downloads, and a conversation with each page.

    The server calls `page` and `download` in worker threads, several at a time. It calls `hello`
    and `receive` in the single thread that serves all pages, so these two must return at once.
    """

    def page(self) -> str:
        """Return the HTML text, with its content security policy in a meta element."""
        ...

    def download(self, name: str) -> tuple[str, bytes] | None:
        """Return media type and content of a file such as "run.nc", or None if it does not exist.

        Raise Unavailable, with a reason for the user, if the file does not exist now.
        """
        ...

    def hello(self) -> list[str | bytes]:
        """Return the messages that bring a new or delayed page up to date.

        A message that is broadcast during this call may reach the page a second time afterwards.
        """
        ...

    def receive(self, message: dict[str, Any]) -> str | None:
        """Handle one JSON object from a page; return an answer for that page alone, or None.

        All numbers of the object are finite, and it nests at most 16 deep. The server itself
        answers an invalid message by a JSON object {"error": message}.
        """
        ...
