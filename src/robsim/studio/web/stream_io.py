"""Bytes to the other side of a connection, for as long as it reads them."""

from __future__ import annotations

import asyncio
import socket

from robsim.studio.web import server_limits

_PIECE = 65_536  # bytes


def limit_write_buffer(writer: asyncio.StreamWriter) -> None:
    """Let what is written wait here until the other side reads, and not pile up on the way."""
    writer.transport.set_write_buffer_limits(0)
    own = writer.get_extra_info("socket")
    own.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, server_limits.SYSTEM)


async def send_and_end(writer: asyncio.StreamWriter, data: bytes) -> None:
    """Send all bytes, then end this direction. TimeoutError: the other side reads nothing."""
    view = memoryview(data)
    for start in range(0, len(view), _PIECE):
        writer.write(view[start : start + _PIECE])
        await drain_writer(writer)
    writer.write_eof()


async def drain_writer(writer: asyncio.StreamWriter) -> None:
    """Wait until the system has taken what was written. TimeoutError: it does not."""
    async with asyncio.timeout(server_limits.PATIENCE):
        await writer.drain()


async def read_leftover_bytes(reader: asyncio.StreamReader) -> None:
    """Read on for a moment: what is closed with bytes unread may take back our last words."""
    try:
        async with asyncio.timeout(server_limits.LINGER):
            while await reader.read(_PIECE):
                pass
    except TimeoutError:
        pass
