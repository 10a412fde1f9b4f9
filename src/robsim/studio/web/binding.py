"""The listening socket of a server: local, unless other machines are explicitly allowed."""

from __future__ import annotations

import ipaddress
import socket

from robsim.base.errors import InputError, format_value

EXPOSED = (
    "anyone on this network who has the address may watch and control this simulation, and "
    "download its files; traffic is not encrypted"
)


def bind_socket(host: str, port: int, allow_remote: bool) -> tuple[socket.socket, bool]:
    """Return a listening socket, and whether other machines can reach it; port 0 is any free port.

    Raise InputError if host or port is invalid or taken, or if the host requires `allow_remote`.
    """
    if not isinstance(host, str) or not host:
        raise InputError(f"host: expected a name or an IP address, got {format_value(host)}")
    if not isinstance(port, int) or not 0 <= port <= 65_535:
        raise InputError(f"port: expected a whole number from 0 to 65535, got {format_value(port)}")
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError):
        raise InputError(f"unknown host {format_value(host)}") from None
    remote = not ipaddress.ip_address(str(address[0]).partition("%")[0]).is_loopback
    if remote and not allow_remote:
        raise InputError(
            f"other machines can reach host {format_value(host)}: pass --allow-remote (in Python "
            f"allow_remote=True) to permit this; then {EXPOSED}"
        )
    try:
        return socket.create_server((str(address[0]), port), family=family), remote
    except OSError as reason:
        raise InputError(f"cannot listen on {host}, port {port}: {reason.strerror}") from None
