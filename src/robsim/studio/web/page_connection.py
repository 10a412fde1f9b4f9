"""The conversation with one page, over a WebSocket."""

from __future__ import annotations

import asyncio
from http import HTTPStatus

from websockets.frames import CloseCode, Frame, Opcode
from websockets.http11 import Request
from websockets.protocol import State
from websockets.server import ServerProtocol

from robsim.studio.web import server_limits
from robsim.studio.web.app import App
from robsim.studio.web.http_responses import WORDS, FailureLog, RefusedRequest
from robsim.studio.web.outbox import Outbox, encode_websocket_frame
from robsim.studio.web.page_messages import (
    BadMessage,
    MessageBudget,
    encode_error_message,
    parse_page_message,
)
from robsim.studio.web.stream_io import drain_writer

_PIECE = 65_536  # bytes that are looked at together
_DATA = (Opcode.TEXT, Opcode.BINARY, Opcode.CONT)


class PageConnection:
    """What a page says goes to the app; what the app says goes to the page, while it listens.

    The bytes of WebSocket are those of `websockets`; here is what it leaves to us: how much is
    kept for a page, and how long it is waited for.
    """

    def __init__(
        self,
        app: App,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        protocol: ServerProtocol,
        failures: FailureLog,
    ) -> None:
        """Take a connection on which a page asks for a WebSocket, and what has read its request."""
        self.outbox, self.woken = Outbox(), asyncio.Event()
        self._app, self._reader, self._writer, self._failures = app, reader, writer, failures
        self._protocol = protocol
        self._budget, self._bad = MessageBudget(), 0
        self._parts, self._binary = bytearray(), False
        self._heard = asyncio.get_running_loop().time()

    def accept(self, request: Request) -> None:
        """Answer the handshake. Refused: it is none."""
        response = self._protocol.accept(request)
        if response.status_code != HTTPStatus.SWITCHING_PROTOCOLS:
            raise RefusedRequest(
                HTTPStatus.BAD_REQUEST, "This is not the handshake of a WebSocket."
            )
        self._protocol.send_response(response)

    async def talk(self) -> None:
        """Send and receive until one of the two ends it, or the page is not there any more."""
        await self._flush()
        work = [asyncio.ensure_future(each) for each in (self._send(), self._hear(), self._ask())]
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
        """Tell the page that this is the end, and why."""
        if self._protocol.state is State.OPEN:
            self._protocol.fail(code, why)
            await self._flush()

    async def _send(self) -> None:
        """Send what is new, and to a page that fell behind what brings it to the present."""
        while self._protocol.state is State.OPEN:
            self.woken.clear()
            if self.outbox.start_anew():
                for message in await self._hello():
                    await self._write(encode_websocket_frame(message))
            while frame := self.outbox.take():
                await self._write(frame)
            await self.woken.wait()

    async def _hello(self) -> list[str | bytes]:
        try:
            return self._app.hello()
        except Exception:  # noqa: BLE001  whatever the app raises, the server goes on
            self._failures.log("what a new page is told")
            await self.close(CloseCode.INTERNAL_ERROR, WORDS)
            return []

    async def _write(self, frame: bytes) -> None:
        if self._protocol.state is State.OPEN:
            self._writer.write(frame)
            await drain_writer(self._writer)

    async def _flush(self) -> None:
        """Send what the protocol has to say, if anything; empty bytes are its sign for the end."""
        if due := self._protocol.data_to_send():
            for data in due:
                if data:
                    self._writer.write(data)
                else:
                    self._writer.write_eof()
            await drain_writer(self._writer)

    async def _hear(self) -> None:
        """Take what comes; what the page is sent for it waits until it reads that."""
        now = asyncio.get_running_loop().time
        while self._protocol.state is State.OPEN and (data := await self._reader.read(_PIECE)):
            self._heard = now()
            self._protocol.receive_data(data)
            for frame in self._protocol.events_received():
                if self._protocol.state is State.OPEN and isinstance(frame, Frame):
                    self._take(frame)
            await self._flush()

    async def _ask(self) -> None:
        """Ask now and then whether the page is there; end where nothing is heard of it."""
        now = asyncio.get_running_loop().time
        while self._protocol.state is State.OPEN and now() - self._heard < server_limits.PATIENCE:
            self._protocol.send_ping(b"")
            await self._flush()
            await asyncio.sleep(server_limits.PING)

    def _take(self, frame: Frame) -> None:
        """Count a frame, of whatever kind, and put the parts of a message together."""
        if not self._budget.spend(self._heard):
            why = f"more than {server_limits.RATE:.0f} messages a second"
            self._protocol.fail(CloseCode.POLICY_VIOLATION, why)
        elif frame.opcode in _DATA:
            if frame.opcode is not Opcode.CONT:
                self._parts, self._binary = bytearray(), frame.opcode is Opcode.BINARY
            self._parts += frame.data
            if frame.fin:
                self._receive(bytes(self._parts))

    def _receive(self, data: bytes) -> None:
        """Give a message to the app; answer in words what cannot be taken."""
        try:
            if self._binary:
                raise BadMessage("a message is text, and this is binary")
            answer = self._app.receive(parse_page_message(data))
            frame = encode_websocket_frame(answer) if answer is not None else b""
        except BadMessage as bad:
            self._bad += 1
            frame = encode_websocket_frame(encode_error_message(str(bad)))
        except Exception:  # noqa: BLE001  whatever the app raises, the server goes on
            self._failures.log("a message from a page")
            frame = encode_websocket_frame(encode_error_message(WORDS))
        if self._bad >= server_limits.BAD:
            self._protocol.fail(CloseCode.POLICY_VIOLATION, "too many malformed messages")
        elif frame:
            self.outbox.put(frame)
            self.woken.set()
