"""Requests of HTTP/1.1: a line and headers, taken strictly and never decoded."""

from __future__ import annotations

import asyncio
import re
from dataclasses import dataclass
from http import HTTPStatus

from robsim.studio.web import limits
from robsim.studio.web.answers import Refused

_LINE = re.compile(r"([A-Z]{1,20}) (\S+) HTTP/1\.[01]")
_TARGET = re.compile(r"/[!-~]*")
_HEADER = re.compile(r"([!#$%&'*+.^_`|~0-9A-Za-z-]+):[\t ]*([\t\x20-\x7e\x80-\xff]*)")
_END = b"\r\n\r\n"


@dataclass(frozen=True)
class Request:
    """What is asked for; `raw` are the bytes as they came."""

    method: str
    target: str
    headers: tuple[tuple[str, str], ...]
    raw: bytes

    def header(self, name: str) -> str | None:
        """Return the value of a header by its name in small letters; None where there is none.

        Refused: it is there twice, for then another reader might take the other one.
        """
        values = [value for other, value in self.headers if other == name]
        if len(values) > 1:
            raise _malformed()
        return values[0] if values else None


async def read_request(reader: asyncio.StreamReader) -> Request:
    """Return the next request.

    Refused: malformed, too long, or too slow. EOFError: the other side went, or says nothing, as
    browsers do that connect ahead of need.
    """
    begun = b""
    try:
        async with asyncio.timeout(limits.HEAD_SECONDS):
            begun = await reader.readexactly(1)
            return _parsed(begun + await reader.readuntil(_END))
    except asyncio.LimitOverrunError:
        if b"\r\n" in await reader.read(limits.LINE):
            status = HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE
            raise Refused(status, "The headers of this request are too long.") from None
        raise _too_long() from None
    except TimeoutError:
        if not begun:
            raise EOFError from None
        status = HTTPStatus.REQUEST_TIMEOUT
        raise Refused(status, "This request did not come to its end in time.") from None


def _parsed(raw: bytes) -> Request:
    first, *rest = raw.removesuffix(_END).decode("latin-1").split("\r\n")
    if len(first) > limits.LINE:
        raise _too_long()
    line, headers = _LINE.fullmatch(first), [_HEADER.fullmatch(each) for each in rest]
    if not line or not _TARGET.fullmatch(line[2]) or not all(headers):
        raise _malformed()
    pairs = tuple((found[1].lower(), found[2].rstrip("\t ")) for found in headers if found)
    return Request(line[1], line[2], pairs, raw)


def _malformed() -> Refused:
    return Refused(HTTPStatus.BAD_REQUEST, "This is not a request of a browser.")


def _too_long() -> Refused:
    return Refused(HTTPStatus.REQUEST_URI_TOO_LONG, "The address of this request is too long.")
