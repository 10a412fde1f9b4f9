"""Who may come in: the browser that has the token, under a name of ours, from our own page.

Any page that a person has open can send requests to this machine, and any name can be made to
point to it. So the name in `Host` is looked at (against DNS rebinding), where the request came
from, and a cookie, which the browser gets for the token in the address that was printed.
"""

from __future__ import annotations

import ipaddress
import secrets
import socket
from http import HTTPStatus

from websockets.http11 import Request, Response

from robsim.studio.web.http_requests import read_single_header
from robsim.studio.web.http_responses import RefusedRequest, build_response

ENTRY = "/?token="
_LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
_ASK = "Open the address that the command printed, with its token."


class AccessGate:
    """The names, the token and the cookie of one server."""

    def __init__(self, host: str, port: int) -> None:
        """Take the host as it was given, and the port on which the server listens."""
        self._token = secrets.token_urlsafe(24)
        self._cookie = f"robsim_{port}"
        self._end = f":{port}" if port != 80 else ""  # which browsers leave out
        self._any = _is_ip_address(host) and ipaddress.ip_address(host).is_unspecified
        own = f"[{host.lower()}]" if ":" in host else host.lower()
        name = socket.gethostname().lower() if self._any else own
        self._hosts = [each + self._end for each in (*_LOOPBACK, name)]
        self.address = f"http://{name}{self._end}{ENTRY}{self._token}"

    def check(self, request: Request) -> None:
        """Raise Refused unless this is a GET to a name of ours with the cookie.

        The address with the token needs no cookie, and alone may be a link in another page.
        """
        if not self._is_ours(read_single_header(request, "host") or ""):
            raise RefusedRequest(HTTPStatus.FORBIDDEN, f"This is another host's name. {_ASK}")
        if request.method != "GET":
            status = HTTPStatus.METHOD_NOT_ALLOWED
            raise RefusedRequest(status, "Only GET is answered here.", Allow="GET")
        if request.path.startswith(ENTRY):
            return
        if _is_cross_site(request):
            raise RefusedRequest(HTTPStatus.FORBIDDEN, f"Another page asks for this. {_ASK}")
        if not self._has_cookie(request):
            raise RefusedRequest(HTTPStatus.FORBIDDEN, _ASK)

    def check_origin(self, request: Request) -> None:
        """Raise Refused unless a page of ours asks."""
        if read_single_header(request, "origin") != f"http://{read_single_header(request, 'host')}":
            raise RefusedRequest(HTTPStatus.FORBIDDEN, f"Another page asks for this. {_ASK}")

    def entered(self, request: Request) -> Response:
        """Return the answer to the address with the token: the cookie, and the way to the page.

        Behind a redirect of a link in another page the browser would not send the cookie, for
        that page began it; so there the page is loaded anew by an answer of ours.
        """
        if not _is_equal_token(request.path.removeprefix(ENTRY), self._token):
            raise RefusedRequest(
                HTTPStatus.FORBIDDEN, f"This token is not, or no more, ours. {_ASK}"
            )
        cookie = f"{self._cookie}={self._token}; HttpOnly; SameSite=Strict; Path=/"
        status, way = HTTPStatus.SEE_OTHER, {"Location": "/"}
        if _is_cross_site(request):
            status, way = HTTPStatus.OK, {"Refresh": "0; url=/"}
        return build_response(status, b"Opening the studio.\n", **way, Set_Cookie=cookie)

    def _is_ours(self, host: str) -> bool:
        number = self._any and host.endswith(self._end) and host.removesuffix(self._end)
        return host.lower() in self._hosts or (bool(number) and _is_ip_address(str(number)))

    def _has_cookie(self, request: Request) -> bool:
        pairs = (
            pair.partition("=") for pair in (read_single_header(request, "cookie") or "").split(";")
        )
        given = [value for name, _, value in pairs if name.strip() == self._cookie]
        return any(_is_equal_token(value, self._token) for value in given)


def _is_equal_token(given: str, token: str) -> bool:
    """Return whether they are equal, in a time that does not tell how much of them is."""
    return secrets.compare_digest(given.encode(), token.encode())


def _is_cross_site(request: Request) -> bool:
    """Return whether a page began this that is not ours; other programs do not say."""
    return read_single_header(request, "sec-fetch-site") not in (None, "none", "same-origin")


def _is_ip_address(host: str) -> bool:
    """Return whether a host is an IP address, which no foreign name can be made to be."""
    try:
        ipaddress.ip_address(host.removeprefix("[").removesuffix("]"))
    except ValueError:
        return False
    return True
