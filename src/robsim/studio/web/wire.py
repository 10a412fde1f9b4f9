"""Bytes to the other side of a connection, for as long as it reads them."""

from __future__ import annotations

import asyncio
import socket

from robsim.studio.web import limits

_PIECE = 65_536  # bytes


def hold_little(writer: asyncio.StreamWriter) -> None:
    """Let what is written wait here until the other side reads, and not pile up on the way."""
    writer.transport.set_write_buffer_limits(0)
    own = writer.get_extra_info("socket")
    own.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, limits.SYSTEM)


async def send(writer: asyncio.StreamWriter, data: bytes) -> None:
    """Send all bytes, then end this direction. TimeoutError: the other side reads nothing."""
    view = memoryview(data)
    for start in range(0, len(view), _PIECE):
        writer.write(view[start : start + _PIECE])
        await drained(writer)
    writer.write_eof()


async def drained(writer: asyncio.StreamWriter) -> None:
    """Wait until the system has taken what was written. TimeoutError: it does not."""
    async with asyncio.timeout(limits.PATIENCE):
        await writer.drain()


async def linger(reader: asyncio.StreamReader) -> None:
    """Read on for a moment: what is closed with bytes unread may take back our last words."""
    try:
        async with asyncio.timeout(limits.LINGER):
            while await reader.read(_PIECE):
                pass
    except TimeoutError:
        pass
