"""HTTP responses, with headers that keep other pages out, and without secrets.

Internal failures are logged the first time they occur at a place, and never sent to a client.
"""

from __future__ import annotations

import logging
from http import HTTPStatus

from websockets.datastructures import Headers
from websockets.http11 import Response

POLICY = "Content-Security-Policy"
INTERNAL_ERROR = "internal error; see the output of the command"
_LOG = logging.getLogger("robsim.studio")
PLAIN_TEXT = "text/plain; charset=utf-8"
_ALWAYS = {
    POLICY: "default-src 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Connection": "close",
}


def build_response(
    status: HTTPStatus, body: bytes, media: str = PLAIN_TEXT, **headers: str
) -> Response:
    """Return a response with its own headers beside the headers of every response.

    In the names of keyword arguments _ stands for -.
    """
    content = {"Content-Type": media, "Content-Length": str(len(body))}
    own = {name.replace("_", "-"): value for name, value in headers.items()}
    return Response(status.value, status.phrase, Headers({**_ALWAYS, **content, **own}), body)


class RefusedRequest(Exception):
    """An error that refuses a request by a response with an explanation."""

    def __init__(self, status: HTTPStatus, why: str, **headers: str) -> None:
        super().__init__(why)
        self.answer = build_response(status, f"{why}\n".encode(), **headers)


class FailureLog:
    """Record of failures, so that a page cannot fill the log by repeating a request."""

    def __init__(self) -> None:
        self._known: set[str] = set()

    def log(self, action: str) -> None:
        """Log the exception that is being handled, unless the same action failed before."""
        if action not in self._known:
            self._known.add(action)
            _LOG.exception("%s failed; repeated failures are not logged", action)
