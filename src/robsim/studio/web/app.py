"""Interface between the server and its app, independent of HTTP and WebSocket."""

from __future__ import annotations

from typing import Any, Protocol


class UnavailableDownload(Exception):
    """Error of an app if a file is not available; its message is sent to the page."""


class App(Protocol):
    """An app of a server: a page, downloads, and an exchange of messages with each page.

    The server calls `page`, `download` and `file_name` in several worker threads. It calls `hello`
    and `receive` in the single thread that serves all pages, so they must return quickly.
    """

    def page(self) -> str:
        """Return the HTML text, with its content security policy in a meta element."""
        ...

    def download(self, name: str) -> tuple[str, bytes] | None:
        """Return media type and content of a file such as "run.nc", or None if it does not exist.

        Raise UnavailableDownload with a reason if the file is temporarily not available.
        """
        ...

    def file_name(self, name: str) -> str:
        """Return the name, of printable ASCII without quotes, under which a file is stored."""
        ...

    def hello(self) -> list[str | bytes]:
        """Return the messages that bring a new or delayed page up to date.

        A message that is broadcast during this call may reach the page a second time afterwards.
        """
        ...

    def receive(self, message: dict[str, Any]) -> str | None:
        """Handle one JSON object from a page; return an answer for that page alone, or None.

        All numbers of the object are finite, and its depth is at most 16. The server itself
        answers an invalid message with a JSON object {"error": message}.
        """
        ...
