"""Answers of HTTP: each with the headers that keep other pages out, and none with a secret.

Failures inside are logged the first time at each place, and never told to the outside.
"""

from __future__ import annotations

import logging
from http import HTTPStatus

from websockets.datastructures import Headers
from websockets.http11 import Response

POLICY = "Content-Security-Policy"
WORDS = "internal error; the command's own output says more"
_LOG = logging.getLogger("robsim.studio")
TEXT = "text/plain; charset=utf-8"
_ALWAYS = {
    POLICY: "default-src 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Connection": "close",
}


def build_response(status: HTTPStatus, body: bytes, media: str = TEXT, **headers: str) -> Response:
    """Return an answer with headers beyond those of every answer, _ in their names for -."""
    content = {"Content-Type": media, "Content-Length": str(len(body))}
    own = {name.replace("_", "-"): value for name, value in headers.items()}
    return Response(status.value, status.phrase, Headers({**_ALWAYS, **content, **own}), body)


class RefusedRequest(Exception):
    """A request that is not granted, and the sentence that says why."""

    def __init__(self, status: HTTPStatus, why: str, **headers: str) -> None:
        super().__init__(why)
        self.answer = build_response(status, f"{why}\n".encode(), **headers)


class FailureLog:
    """What has failed so far, so that a page cannot fill the log by asking again."""

    def __init__(self) -> None:
        self._known: set[str] = set()

    def log(self, what: str) -> None:
        """Log the exception that is being handled, unless the same failed before."""
        if what not in self._known:
            self._known.add(what)
            _LOG.exception("%s failed; when it fails again, nothing is said", what)
