"""HTTP responses, with headers that deny access to other pages.

Internal failures are not sent to clients. They are logged, once for each kind of action.
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
    """Return a response with the common headers and further `headers`.

    An underscore in the name of a keyword argument becomes a hyphen.
    """
    content = {"Content-Type": media, "Content-Length": str(len(body))}
    own = {name.replace("_", "-"): value for name, value in headers.items()}
    return Response(status.value, status.phrase, Headers({**_ALWAYS, **content, **own}), body)


class RefusedRequest(Exception):
    """Error that refuses a request; `answer` is the response with the reason."""

    def __init__(self, status: HTTPStatus, why: str, **headers: str) -> None:
        super().__init__(why)
        self.answer = build_response(status, f"{why}\n".encode(), **headers)


class FailureLog:
    """Log of failures without repetitions, so that repeated requests cannot fill it."""

    def __init__(self) -> None:
        self._logged_actions: set[str] = set()

    def log(self, action: str) -> None:
        """Log the exception that is being handled, unless the same action failed before."""
        if action not in self._logged_actions:
            self._logged_actions.add(action)
            _LOG.exception("%s failed; repeated failures are not logged", action)
