"""HTTP/1.1 requests, parsed strictly by `websockets` and never decoded."""

from __future__ import annotations

import asyncio
import re
from http import HTTPStatus

from websockets.datastructures import MultipleValuesError
from websockets.exceptions import HeaderLineTooLong, RequestLineTooLong, TooManyHeaders
from websockets.http11 import Request
from websockets.server import ServerProtocol

from robsim.studio.web import server_limits
from robsim.studio.web.http_responses import RefusedRequest

_OURS = re.compile(r"[A-Z]{1,20} /[!-~]*")  # method and target


async def read_request(reader: asyncio.StreamReader, protocol: ServerProtocol) -> Request:
    """Return the next request; bytes after it stay in the reader.

    Raise RefusedRequest if the request is malformed, too long or too slow. Raise EOFError if the
    client closes the connection or sends nothing, as browsers do after connecting in advance.
    """
    size = 0
    try:
        async with asyncio.timeout(server_limits.HEAD_SECONDS):
            while not (events := protocol.events_received()):
                data = await _read_request_line(reader)
                size += len(data)
                protocol.receive_data(data)
                if size > server_limits.HEAD or protocol.handshake_exc:
                    raise _build_refusal(protocol.handshake_exc or TooManyHeaders())
    except TimeoutError:
        if not size:
            raise EOFError from None
        status = HTTPStatus.REQUEST_TIMEOUT
        raise RefusedRequest(status, "The request was not complete in time.") from None
    (request,) = events
    if isinstance(request, Request) and _OURS.fullmatch(f"{request.method} {request.path}"):
        return request
    raise _build_refusal(None)


def read_single_header(request: Request, name: str) -> str | None:
    """Return the value of a header, or None.

    Raise RefusedRequest if the header occurs twice: another program may use the other value.
    """
    try:
        return request.headers.get(name)
    except MultipleValuesError as error:
        raise _build_refusal(error) from None


async def _read_request_line(reader: asyncio.StreamReader) -> bytes:
    """Return the next line, or the first part of a line that is too long."""
    try:
        return await reader.readuntil(b"\n")
    except asyncio.LimitOverrunError:
        return await reader.read(server_limits.HEAD)


def _build_refusal(error: Exception | None) -> RefusedRequest:
    """Return the refusal of a request that `websockets` does not accept."""
    if isinstance(error, RequestLineTooLong):
        status = HTTPStatus.REQUEST_URI_TOO_LONG
        return RefusedRequest(status, "The address of this request is too long.")
    if isinstance(error, HeaderLineTooLong | TooManyHeaders):
        status = HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE
        return RefusedRequest(status, "The headers of this request are too long.")
    return RefusedRequest(HTTPStatus.BAD_REQUEST, "This is not a request of a browser.")
