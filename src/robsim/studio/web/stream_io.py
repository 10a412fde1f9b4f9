"""Reading and writing of connections, with time limits."""

from __future__ import annotations

import asyncio
import socket

from robsim.studio.web import server_limits

_PIECE = 65_536  # bytes


def limit_write_buffer(writer: asyncio.StreamWriter) -> None:
    """Limit the send buffers, so that `drain_writer` waits until the client reads."""
    writer.transport.set_write_buffer_limits(0)
    own = writer.get_extra_info("socket")
    own.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, server_limits.SYSTEM)


async def send_and_end(writer: asyncio.StreamWriter, data: bytes) -> None:
    """Send all bytes and the end of the stream; raise TimeoutError if the client does not read."""
    view = memoryview(data)
    for start in range(0, len(view), _PIECE):
        writer.write(view[start : start + _PIECE])
        await drain_writer(writer)
    writer.write_eof()


async def drain_writer(writer: asyncio.StreamWriter) -> None:
    """Wait until the system has accepted all data; raise TimeoutError after `PATIENCE`."""
    async with asyncio.timeout(server_limits.PATIENCE):
        await writer.drain()


async def read_leftover_bytes(reader: asyncio.StreamReader) -> None:
    """Read for at most `LINGER`: closing a socket with unread bytes may discard the response."""
    try:
        async with asyncio.timeout(server_limits.LINGER):
            while await reader.read(_PIECE):
                pass
    except TimeoutError:
        pass
