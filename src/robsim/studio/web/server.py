"""A server in one thread that shows an app to browsers, without blocking its caller."""

from __future__ import annotations

import asyncio
import ipaddress
import socket
import threading
from contextlib import suppress
from http import HTTPStatus
from typing import Self

from websockets.frames import CloseCode
from websockets.http11 import Request
from websockets.server import ServerProtocol

from robsim.base.errors import InputError, format_value
from robsim.studio.web import server_limits
from robsim.studio.web.access_gate import ENTRY, AccessGate
from robsim.studio.web.app import App
from robsim.studio.web.http_requests import read_request, read_single_header
from robsim.studio.web.http_responses import FailureLog, RefusedRequest
from robsim.studio.web.outbox import encode_websocket_frame
from robsim.studio.web.page_connection import PageConnection
from robsim.studio.web.site import SOCKET, Site
from robsim.studio.web.stream_io import limit_write_buffer, read_leftover_bytes, send_and_end

_Streams = tuple[asyncio.StreamReader, asyncio.StreamWriter]
EXPOSED = (
    "anyone on this network who has the address may watch and control this simulation, and "
    "download its files; traffic is not encrypted"
)


class Server:
    """Server of an app at an address of this machine, from its construction until it is closed.

    Attributes
    ----------
    address : str
        Address to open in a browser, with the token that grants access.
    exposed : str
        Description of the access of other machines; empty if only this machine can connect.
    """

    def __init__(
        self, app: App, host: str = "127.0.0.1", port: int = 0, allow_remote: bool = False
    ) -> None:
        """Listen on a port; port 0 is any free port.

        Raise InputError if the address is not available, or requires `allow_remote`.
        """
        self._socket, remote = _bind_socket(host, port, allow_remote)
        self._gate = AccessGate(host, self._socket.getsockname()[1])
        self.address, self.exposed = self._gate.address, EXPOSED if remote else ""
        self._app, self._failures = app, FailureLog()
        self._site = Site(app, self._failures)
        self._links: tuple[PageConnection, ...] = ()
        self._open: set[asyncio.Task[None]] = set()
        self._waking, self._ready, self._ended = False, threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="robsim-studio", daemon=True)
        self._thread.start()
        self._ready.wait()

    def __enter__(self) -> Self:
        """Return the server, which is closed at the end of the block."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the server."""
        self.close()

    @property
    def pages(self) -> int:
        """The number of connected pages."""
        return len(self._links)

    def broadcast(self, message: str | bytes) -> None:
        """Send a message to all pages, from any thread, without waiting."""
        links = self._links
        if links:
            frame = encode_websocket_frame(message)
            for link in links:
                link.outbox.put(frame)
            self._wake()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until the server has ended, for at most `timeout` seconds; return whether it has."""
        return self._ended.wait(timeout)

    def close(self) -> None:
        """Close all connections and threads within two seconds; a second call has no effect."""
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self._stop.set)
        if threading.current_thread() is not self._thread:  # a request handler may close the server
            self._thread.join()

    def _wake(self) -> None:
        """Schedule `_wake_links` in the loop, unless it is scheduled."""
        if not self._waking:
            self._waking = True
            with suppress(RuntimeError):  # the loop has ended
                self._loop.call_soon_threadsafe(self._wake_links)

    def _wake_links(self) -> None:
        """Let every connection send its waiting frames."""
        self._waking = False
        for link in self._links:
            link.woken.set()

    def _run(self) -> None:
        """Run the loop until the server is closed."""
        try:
            asyncio.run(self._main())
        finally:
            self._site.close()
            self._ended.set()
            self._ready.set()

    async def _main(self) -> None:
        """Accept connections until the server is closed."""
        self._loop, self._stop = asyncio.get_running_loop(), asyncio.Event()
        self._answers = asyncio.Semaphore(server_limits.ANSWERS)
        server = await asyncio.start_server(
            self._start_serving, sock=self._socket, limit=server_limits.HEAD
        )
        self._ready.set()
        await self._stop.wait()
        server.close()
        await self._farewell()

    async def _farewell(self) -> None:
        """Close the connections of pages, and cancel the remaining tasks."""
        closing = [
            asyncio.ensure_future(link.close(CloseCode.GOING_AWAY, "the studio has ended"))
            for link in self._links
        ]
        if work := {*closing, *self._open}:
            await asyncio.wait(work, timeout=server_limits.FAREWELL)
            for each in work:
                each.cancel()
            await asyncio.gather(*work, return_exceptions=True)
        await asyncio.sleep(0)  # lets aborted connections close

    def _start_serving(self, *streams: *_Streams) -> None:
        """Start a task for a new connection."""
        task = self._loop.create_task(self._serve_connection(*streams))
        self._open.add(task)
        task.add_done_callback(self._open.discard)

    async def _serve_connection(self, *streams: *_Streams) -> None:
        """Serve one connection until it ends; failures do not affect other connections."""
        reader, writer = streams
        try:
            limit_write_buffer(writer)
            if len(self._open) > server_limits.CONNECTIONS:
                writer.write(
                    _build_busy_refusal("connections").answer.serialize()
                )  # without waiting
                return
            await self._serve_request(*streams)
            await read_leftover_bytes(reader)
        except (OSError, EOFError):
            pass  # the client has closed the connection, or does not read
        except Exception:  # noqa: BLE001  a failure must not affect other connections
            self._failures.log("a connection")
        finally:
            writer.transport.abort()

    async def _serve_request(self, *streams: *_Streams) -> None:
        """Read a request and respond, or open a WebSocket."""
        reader, writer = streams
        protocol = ServerProtocol(max_size=server_limits.MESSAGE)
        try:
            request = await read_request(reader, protocol)
            self._gate.check(request)
            if request.path == SOCKET and read_single_header(request, "upgrade"):
                await self._serve_page(request, protocol, *streams)
            else:
                await self._respond(request, writer)
        except RefusedRequest as refused:
            await send_and_end(writer, refused.answer.serialize())

    async def _respond(self, request: Request, writer: asyncio.StreamWriter) -> None:
        """Send the response to a request."""
        if request.path.startswith(ENTRY):
            await send_and_end(writer, self._gate.enter(request).serialize())
            return
        async with self._answers:
            await send_and_end(writer, (await self._site.answer(request.path)).serialize())

    async def _serve_page(
        self, request: Request, protocol: ServerProtocol, *streams: *_Streams
    ) -> None:
        """Connect a page, and serve it until either side closes the connection."""
        self._gate.check_origin(request)
        if len(self._links) >= server_limits.PAGES:
            raise _build_busy_refusal("pages")
        link = PageConnection(self._app, *streams, protocol, self._failures)
        link.accept(request)
        self._links = (*self._links, link)
        try:
            await link.talk()
        finally:
            self._links = tuple(other for other in self._links if other is not link)


def _build_busy_refusal(kind: str) -> RefusedRequest:
    """Return the refusal of a further connection or page."""
    status = HTTPStatus.SERVICE_UNAVAILABLE
    return RefusedRequest(status, f"Too many {kind} are open; close one and try again.")


def _bind_socket(host: str, port: int, allow_remote: bool) -> tuple[socket.socket, bool]:
    """Return a listening socket, and whether other machines can reach it.

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
