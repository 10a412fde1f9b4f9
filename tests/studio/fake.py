"""An app without a simulation, and a browser without a window."""

import json
import socket
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import NamedTuple

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

PAGE = (
    '<!doctype html><meta http-equiv="Content-Security-Policy" '
    "content=\"default-src 'none'; script-src 'sha256-abc='; connect-src 'none'\">"
    "<title>fake</title>the page"
)
FILES = {"run.nc": ("application/x-netcdf", bytes(range(256)) * 4000), "a.txt": ("text/plain", b"")}


@dataclass
class Fake:
    """Repeats the messages of a page; reports a new page; fails on demand."""

    fails: tuple[str, ...] = ()
    heard: list[dict] = field(default_factory=list)
    hellos: int = 0

    def page(self):
        self._fail("page")
        return PAGE

    def download(self, name):
        self._fail("download")
        return FILES.get(name)

    def file_name(self, name):
        return name

    def hello(self):
        self._fail("hello")
        self.hellos += 1
        return [f"hello {self.hellos}", b"\0numbers"]

    def receive(self, message):
        self._fail("receive")
        self.heard.append(message)
        return json.dumps(message) if message.get("answer", True) else None

    def _fail(self, where):
        if where in self.fails:
            raise RuntimeError("a secret")


class Answer(NamedTuple):
    """The answer of a server; the names of headers are in small letters."""

    status: int
    headers: dict[str, str]
    body: bytes


class Browser:
    """One that has opened the address of a server, and so has its cookie."""

    def __init__(self, server):
        self.port = int(server.address.split(":")[2].split("/")[0])
        self.token = server.address.split("token=")[1]
        self.host = f"127.0.0.1:{self.port}"
        self.cookie = f"robsim_{self.port}={self.token}"
        self.own = {"Host": self.host, "Cookie": self.cookie}

    def get(self, target="/", method="GET", **headers):
        """Send a request; a header that is None is left out, and Sec_Fetch_Site has dashes."""
        given = {**self.own, **{name.replace("_", "-"): value for name, value in headers.items()}}
        lines = [f"{name}: {value}" for name, value in given.items() if value is not None]
        return self.raw("\r\n".join([f"{method} {target} HTTP/1.1", *lines, "", ""]).encode())

    def raw(self, data):
        """Send bytes; return the answer, or None if there is none."""
        with self.connected() as stream:
            stream.sendall(data)
            return answer(everything(stream))

    def connected(self):
        """A connection without any message yet."""
        return socket.create_connection(("127.0.0.1", self.port), timeout=20)

    @contextmanager
    def page(self, **options):
        """A page that is connected, and has received the present state."""
        with self.silent_page(**options) as link:
            assert link.recv(20).startswith("hello ") and link.recv(20) == b"\0numbers"
            yield link

    def silent_page(self, origin=None, headers=None, **options):
        """A page that is connected for a `with` block, and has read nothing."""
        return connect(
            f"ws://{self.host}/socket",
            origin=origin or f"http://{self.host}",
            additional_headers=headers or {"Cookie": self.cookie},
            compression=None,
            **options,
        )

    def handshake(self, **headers):
        """The request for a WebSocket as bytes; a header that is None is left out."""
        given = {
            **self.own,
            "Origin": f"http://{self.host}",
            "Connection": "Upgrade",
            "Upgrade": "websocket",
            "Sec-WebSocket-Version": "13",
            "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
            **headers,
        }
        lines = [f"{name}: {value}" for name, value in given.items() if value is not None]
        return "\r\n".join(["GET /socket HTTP/1.1", *lines, "", ""]).encode()


def everything(stream):
    """All bytes until the other side has sent its last."""
    parts = []
    try:
        while part := stream.recv(65_536):
            parts.append(part)
    except ConnectionError:
        pass  # it went without a word, or after its last
    return b"".join(parts)


def answer(data):
    """The answer in some bytes, if any."""
    head, _, body = data.partition(b"\r\n\r\n")
    if not head:
        return None
    first, *lines = head.decode().split("\r\n")
    headers = {name.lower(): value for name, _, value in (each.partition(": ") for each in lines)}
    return Answer(int(first.split(" ")[1]), headers, body)


def closed(page):
    """Read until the page is closed; return code and reason."""
    with suppress(ConnectionClosed):
        while True:
            page.recv(20)
    return page.close_code, page.close_reason
