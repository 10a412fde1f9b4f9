"""Access control of a server: the token, the host name, and the origin of requests.

Any page in a browser can send requests to this machine, and the owner of a page can let a domain
name point to this machine (DNS rebinding). The server therefore checks the `Host` header, the
origin of the request, and a cookie. The browser receives the cookie from the printed address, which
contains a token.
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
_HINT = "Open the address that the command printed, with its token."


class AccessGate:
    """The host names, the token and the cookie of one server."""

    def __init__(self, host: str, port: int) -> None:
        """Create the access control of a server that listens on a host and port."""
        self._token = secrets.token_urlsafe(24)
        self._cookie = f"robsim_{port}"
        self._end = f":{port}" if port != 80 else ""  # browsers omit port 80
        self._any = _is_ip_address(host) and ipaddress.ip_address(host).is_unspecified
        own = f"[{host.lower()}]" if ":" in host else host.lower()
        name = socket.gethostname().lower() if self._any else own
        self._hosts = [each + self._end for each in (*_LOOPBACK, name)]
        self.address = f"http://{name}{self._end}{ENTRY}{self._token}"

    def check(self, request: Request) -> None:
        """Raise RefusedRequest unless the request is a GET to an own host name with the cookie.

        The address with the token requires no cookie. Only this address may be linked by other
        pages.
        """
        if not self._is_ours(read_single_header(request, "host") or ""):
            raise RefusedRequest(HTTPStatus.FORBIDDEN, f"This is the name of another host. {_HINT}")
        if request.method != "GET":
            status = HTTPStatus.METHOD_NOT_ALLOWED
            raise RefusedRequest(status, "Only GET is answered here.", Allow="GET")
        if request.path.startswith(ENTRY):
            return
        if _is_cross_site(request):
            raise RefusedRequest(
                HTTPStatus.FORBIDDEN, f"The request comes from another page. {_HINT}"
            )
        if not self._has_cookie(request):
            raise RefusedRequest(HTTPStatus.FORBIDDEN, _HINT)

    def check_origin(self, request: Request) -> None:
        """Raise RefusedRequest unless the request comes from an own page."""
        if read_single_header(request, "origin") != f"http://{read_single_header(request, 'host')}":
            raise RefusedRequest(
                HTTPStatus.FORBIDDEN, f"The request comes from another page. {_HINT}"
            )

    def enter(self, request: Request) -> Response:
        """Return the response to the address with the token: the cookie and a redirect to the page.

        A browser does not send the cookie with a redirected request that began at a link in another
        page. In this case the response is a page that loads the studio.
        """
        if not _is_equal_token(request.path.removeprefix(ENTRY), self._token):
            raise RefusedRequest(HTTPStatus.FORBIDDEN, f"The token is invalid or expired. {_HINT}")
        cookie = f"{self._cookie}={self._token}; HttpOnly; SameSite=Strict; Path=/"
        status, target = HTTPStatus.SEE_OTHER, {"Location": "/"}
        if _is_cross_site(request):
            status, target = HTTPStatus.OK, {"Refresh": "0; url=/"}
        return build_response(status, b"Opening the studio.\n", **target, Set_Cookie=cookie)

    def _is_ours(self, host: str) -> bool:
        """Return whether a `Host` header is a name of this server."""
        number = self._any and host.endswith(self._end) and host.removesuffix(self._end)
        return host.lower() in self._hosts or (bool(number) and _is_ip_address(str(number)))

    def _has_cookie(self, request: Request) -> bool:
        """Return whether a request has the cookie of this server."""
        pairs = (
            pair.partition("=") for pair in (read_single_header(request, "cookie") or "").split(";")
        )
        values = [value for name, _, value in pairs if name.strip() == self._cookie]
        return any(_is_equal_token(value, self._token) for value in values)


def _is_equal_token(text: str, token: str) -> bool:
    """Return whether a text equals the token, in a time that does not depend on the text."""
    return secrets.compare_digest(text.encode(), token.encode())


def _is_cross_site(request: Request) -> bool:
    """Return whether another page caused the request, by a header that only browsers send."""
    return read_single_header(request, "sec-fetch-site") not in (None, "none", "same-origin")


def _is_ip_address(host: str) -> bool:
    """Return whether a host is an IP address, which no domain name can imitate."""
    try:
        ipaddress.ip_address(host.removeprefix("[").removesuffix("]"))
    except ValueError:
        return False
    return True
