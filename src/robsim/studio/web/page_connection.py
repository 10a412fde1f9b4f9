"""The WebSocket connection of one page."""

from __future__ import annotations

import asyncio
from http import HTTPStatus

from websockets.frames import CloseCode, Frame, Opcode
from websockets.http11 import Request
from websockets.protocol import State
from websockets.server import ServerProtocol

from robsim.studio.web import server_limits
from robsim.studio.web.app import App
from robsim.studio.web.http_responses import INTERNAL_ERROR, FailureLog, RefusedRequest
from robsim.studio.web.outbox import Outbox, encode_websocket_frame
from robsim.studio.web.page_messages import (
    BadMessage,
    MessageBudget,
    encode_error_message,
    parse_page_message,
)
from robsim.studio.web.stream_io import drain_writer

_PIECE = 65_536  # bytes read at a time
_DATA = (Opcode.TEXT, Opcode.BINARY, Opcode.CONT)


class PageConnection:
    """A connection that passes messages between a page and the app.

    `websockets` parses and writes the protocol. This class limits the data stored for a page, and
    the time to wait for a page.
    """

    def __init__(
        self,
        app: App,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        protocol: ServerProtocol,
        failures: FailureLog,
    ) -> None:
        """Take over the connection of a WebSocket request, and the protocol that parsed it."""
        self.outbox, self.woken = Outbox(), asyncio.Event()
        self._app, self._reader, self._writer, self._failures = app, reader, writer, failures
        self._protocol = protocol
        self._budget, self._bad = MessageBudget(), 0
        self._parts, self._binary = bytearray(), False
        self._last_read = asyncio.get_running_loop().time()

    def accept(self, request: Request) -> None:
        """Answer the handshake; raise RefusedRequest if it is invalid."""
        response = self._protocol.accept(request)
        if response.status_code != HTTPStatus.SWITCHING_PROTOCOLS:
            raise RefusedRequest(
                HTTPStatus.BAD_REQUEST, "This is not the handshake of a WebSocket."
            )
        self._protocol.send_response(response)

    async def talk(self) -> None:
        """Send and receive until the connection is closed, or the page does not respond."""
        await self._flush()
        work = [asyncio.ensure_future(each) for each in (self._send(), self._read(), self._ping())]
        try:
            await asyncio.wait(work, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for each in work:
                each.cancel()
            ended = await asyncio.gather(*work, return_exceptions=True)
        for end in ended:
            if isinstance(end, Exception):
                raise end

    async def close(self, code: CloseCode, why: str) -> None:
        """Close the connection with a code and a reason."""
        if self._protocol.state is State.OPEN:
            self._protocol.fail(code, why)
            await self._flush()

    async def _send(self) -> None:
        """Send new messages; send a new or delayed page the messages that bring it up to date."""
        while self._protocol.state is State.OPEN:
            self.woken.clear()
            if self.outbox.start_anew():
                for message in await self._hello():
                    await self._write(encode_websocket_frame(message))
            while frame := self.outbox.take():
                await self._write(frame)
            await self.woken.wait()

    async def _hello(self) -> list[str | bytes]:
        """Return the messages that bring the page up to date; close the connection on failure."""
        try:
            return self._app.hello()
        except Exception:  # noqa: BLE001  whatever the app raises, the server goes on
            self._failures.log("the messages for a new page")
            await self.close(CloseCode.INTERNAL_ERROR, INTERNAL_ERROR)
            return []

    async def _write(self, frame: bytes) -> None:
        """Send a frame, and wait until the page can take more."""
        if self._protocol.state is State.OPEN:
            self._writer.write(frame)
            await drain_writer(self._writer)

    async def _flush(self) -> None:
        """Send the pending data of the protocol; an empty item marks the end of the stream."""
        if due := self._protocol.data_to_send():
            for data in due:
                if data:
                    self._writer.write(data)
                else:
                    self._writer.write_eof()
            await drain_writer(self._writer)

    async def _read(self) -> None:
        """Handle incoming data; read no more while the page does not read the responses."""
        now = asyncio.get_running_loop().time
        while self._protocol.state is State.OPEN and (data := await self._reader.read(_PIECE)):
            self._last_read = now()
            self._protocol.receive_data(data)
            for frame in self._protocol.events_received():
                if self._protocol.state is State.OPEN and isinstance(frame, Frame):
                    self._take_frame(frame)
            await self._flush()

    async def _ping(self) -> None:
        """Ping the page at intervals; return if the page does not respond."""
        now = asyncio.get_running_loop().time
        while (
            self._protocol.state is State.OPEN and now() - self._last_read < server_limits.PATIENCE
        ):
            self._protocol.send_ping(b"")
            await self._flush()
            await asyncio.sleep(server_limits.PING)

    def _take_frame(self, frame: Frame) -> None:
        """Count a frame against the budget, and join the parts of a message."""
        if not self._budget.spend(self._last_read):
            why = f"more than {server_limits.RATE:.0f} messages a second"
            self._protocol.fail(CloseCode.POLICY_VIOLATION, why)
        elif frame.opcode in _DATA:
            if frame.opcode is not Opcode.CONT:
                self._parts, self._binary = bytearray(), frame.opcode is Opcode.BINARY
            self._parts += frame.data
            if frame.fin:
                self._receive(bytes(self._parts))

    def _receive(self, data: bytes) -> None:
        """Pass a message to the app; answer an invalid message with an error."""
        try:
            if self._binary:
                raise BadMessage("a message must be text, not binary")
            answer = self._app.receive(parse_page_message(data))
            frame = encode_websocket_frame(answer) if answer is not None else b""
        except BadMessage as bad:
            self._bad += 1
            frame = encode_websocket_frame(encode_error_message(str(bad)))
        except Exception:  # noqa: BLE001  whatever the app raises, the server goes on
            self._failures.log("a message from a page")
            frame = encode_websocket_frame(encode_error_message(INTERNAL_ERROR))
        if self._bad >= server_limits.BAD:
            self._protocol.fail(CloseCode.POLICY_VIOLATION, "too many malformed messages")
        elif frame:
            self.outbox.put(frame)
            self.woken.set()
