"""Where a server listens: on this machine alone, unless other machines are allowed by a word."""

from __future__ import annotations

import ipaddress
import socket

from robsim.base.errors import InputError, format_value

EXPOSED = (
    "anyone on this network who has the address may watch and control this simulation, and "
    "download its files; traffic is not encrypted"
)


def bind_socket(host: str, port: int, allow_remote: bool) -> tuple[socket.socket, bool]:
    """Return a listening socket, and whether other machines reach it; port 0 is any free one.

    InputError: no such host or port, one that is taken, or one that needs `allow_remote`.
    """
    if not isinstance(host, str) or not host:
        raise InputError(f"host is {format_value(host)}, and is to be a name or an IP address")
    if not isinstance(port, int) or not 0 <= port <= 65_535:
        raise InputError(
            f"port is {format_value(port)}, and is to be a whole number from 0 to 65535"
        )
    try:
        family, _, _, _, where = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError):
        raise InputError(f"there is no host {format_value(host)}") from None
    remote = not ipaddress.ip_address(str(where[0]).partition("%")[0]).is_loopback
    if remote and not allow_remote:
        raise InputError(
            f"host {format_value(host)} is seen by other machines: pass --allow-remote (in Python "
            f"allow_remote=True) if that is meant; then {EXPOSED}"
        )
    try:
        return socket.create_server((str(where[0]), port), family=family), remote
    except OSError as reason:
        raise InputError(f"cannot listen on {host}, port {port}: {reason.strerror}") from None
