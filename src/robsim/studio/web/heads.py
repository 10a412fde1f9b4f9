"""Requests of HTTP/1.1, which `websockets` parses, taken strictly and never decoded."""

from __future__ import annotations

import asyncio
import re
from http import HTTPStatus

from websockets.datastructures import MultipleValuesError
from websockets.exceptions import HeaderLineTooLong, RequestLineTooLong, TooManyHeaders
from websockets.http11 import Request
from websockets.server import ServerProtocol

from robsim.studio.web import limits
from robsim.studio.web.answers import Refused

_OURS = re.compile(r"[A-Z]{1,20} /[!-~]*")  # method and target


async def read_request(reader: asyncio.StreamReader, protocol: ServerProtocol) -> Request:
    """Return the next request; bytes behind it stay in the reader.

    Refused: malformed, too long, or too slow. EOFError: the other side went, or says nothing, as
    browsers do that connect ahead of need.
    """
    size = 0
    try:
        async with asyncio.timeout(limits.HEAD_SECONDS):
            while not (found := protocol.events_received()):
                data = await _line(reader)
                size += len(data)
                protocol.receive_data(data)
                if size > limits.HEAD or protocol.handshake_exc:
                    raise _refusal(protocol.handshake_exc or TooManyHeaders())
    except TimeoutError:
        if not size:
            raise EOFError from None
        status = HTTPStatus.REQUEST_TIMEOUT
        raise Refused(status, "This request did not come to its end in time.") from None
    (request,) = found
    if isinstance(request, Request) and _OURS.fullmatch(f"{request.method} {request.path}"):
        return request
    raise _refusal(None)


def header(request: Request, name: str) -> str | None:
    """Return the value of a header; None where there is none.

    Refused: it is there twice, for then another reader might take the other one.
    """
    try:
        return request.headers.get(name)
    except MultipleValuesError as error:
        raise _refusal(error) from None


async def _line(reader: asyncio.StreamReader) -> bytes:
    """Return the next line, or a piece of one that is too long."""
    try:
        return await reader.readuntil(b"\n")
    except asyncio.LimitOverrunError:
        return await reader.read(limits.HEAD)


def _refusal(error: Exception | None) -> Refused:
    """Return the answer to a request that `websockets` does not take."""
    if isinstance(error, RequestLineTooLong):
        status = HTTPStatus.REQUEST_URI_TOO_LONG
        return Refused(status, "The address of this request is too long.")
    if isinstance(error, HeaderLineTooLong | TooManyHeaders):
        status = HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE
        return Refused(status, "The headers of this request are too long.")
    return Refused(HTTPStatus.BAD_REQUEST, "This is not a request of a browser.")
