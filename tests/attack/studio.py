"""Odd traffic to the server of a studio: it goes on, and nobody gets more than the page."""

import json
import logging
import socket
import threading
import time
from contextlib import ExitStack, suppress
from functools import cache
from pathlib import Path

import numpy as np
from attack.harness import Wrong
from studio.fake import FILES, PAGE, Browser, Fake, answer, everything
from websockets.frames import Frame, Opcode

from robsim.studio.web import server_limits
from robsim.studio.web.server import Server

NAME, PATIENCE = "studio", 60.0
RATE, SIZE = 30.0, 100_000  # of broadcast messages: messages a second, bytes
WARM, GROWTH = 10, 30e6  # cases until all is loaded; bytes that all after them may add
REFUSED = {400, 403, 404, 405, 408, 414, 426, 431, 503}
PATHS = [
    "",
    "%2e%2e/",
    "..",
    "%252e%252e%252f",
    "..\\",
    "%5c",
    "\0",
    "%00",
    "run.nc",
    "//",
    "?",
    "#",
]
NAMES = ["Host", "Cookie", "Origin", "Upgrade", "Connection", "Content-Length", "Sec-Fetch-Site"]
NAMES += ["Transfer-Encoding", "Sec-WebSocket-Key", "Sec-WebSocket-Version", "Expect", "Range"]
VALUES = [
    "",
    "evil.example",
    "null",
    "websocket",
    "Upgrade",
    "chunked",
    "5",
    "cross-site",
    "*",
    "13",
]


class Place:
    """A server that broadcasts all the time, and one page that listens to all of it."""

    def __init__(self):
        self.app, self.log, self.ticks, self.seen = Fake(), [], 0, 0
        handler = logging.Handler()
        handler.emit = lambda record: self.log.append(handler.format(record)[-250:])
        for name in ("robsim.studio", "asyncio"):
            logging.getLogger(name).addHandler(handler)
        server_limits.PATIENCE, server_limits.HEAD_SECONDS, server_limits.PING = 3.0, 2.0, 0.5
        self.server = Server(self.app)
        self.browser = Browser(self.server)
        self.cases, self.resident = 0, 0
        for work in (self.tick, self.listen):
            threading.Thread(target=work, daemon=True).start()

    def tick(self):
        """The messages of a simulation, whoever listens."""
        while True:
            self.ticks += 1
            self.server.broadcast(self.ticks.to_bytes(8, "big") + bytes(SIZE - 8))
            time.sleep(1 / RATE)

    def listen(self):
        """The correct actions of a page."""
        with self.browser.page() as page:
            while True:
                message = page.recv(20)
                if isinstance(message, bytes) and len(message) == SIZE:
                    self.seen = int.from_bytes(message[:8], "big")

    def check(self):
        """Raise Wrong unless all goes on as before."""
        self.app.heard.clear()
        begun, end = self.ticks, time.monotonic() + 20
        while self.seen < begun + 3:
            if time.monotonic() > end:
                raise Wrong(f"{self.ticks - begun} ticks in 20 s, and {self.seen - begun} seen")
            time.sleep(0.01)
        if self.browser.get("/").body != PAGE.encode():
            raise Wrong("another page")
        if self.log:
            raise Wrong(f"logged: {self.log[0]}")
        self.cases += 1
        now = resident()
        if self.cases == WARM:
            self.resident = now
        if self.cases > WARM and now > self.resident + GROWTH:
            raise Wrong(f"{(now - self.resident) / 1e6:.0f} MB more than after {WARM} cases")


place = cache(Place)


def resident():
    """Bytes of memory of this process, if the system reports them."""
    status = Path("/proc/self/statm")
    return int(status.read_text().split()[1]) * 4096 if status.exists() else 0


def case(seed):
    """Attack in one way, then look whether all goes on."""
    rng, here = np.random.default_rng(seed), place()
    attack = KINDS[seed % len(KINDS)]
    taken = attack(rng, here.browser)
    here.check()
    return bool(taken)


def pick(rng, among):
    return among[int(rng.integers(len(among)))]


def judged(got, entitled):
    """Raise Wrong if an answer is more than a refusal, and its cookie does not justify it."""
    if got is None or (got.status in REFUSED and len(got.body) < 150):
        return False
    due = {PAGE.encode(), *(content for _, content in FILES.values())}
    if entitled and got.status == 200 and got.body in due:
        return True
    raise Wrong(f"{got.status}: {got.body[:80]!r}, {'with' if entitled else 'without'} cookie")


def send_and_judge(browser, data, entitled=True):
    """Send bytes, and judge what comes."""
    with suppress(ConnectionError), browser.connected() as stream:
        with suppress(ConnectionError):
            stream.sendall(data)
            stream.shutdown(socket.SHUT_WR)
        return judged(answer(everything(stream)), entitled)
    return False


def odd_requests(rng, browser):
    """Requests of random parts and with random bytes."""
    taken = False
    for _ in range(20):
        lines = [f"{name}: {value}" for name, value in browser.own.items()]
        lines += [f"{pick(rng, NAMES)}: {pick(rng, VALUES)}" for _ in range(rng.integers(4))]
        target = pick(rng, ["/", "/socket", "/download/run.nc", "*", "http://127.0.0.1/", "/x"])
        method = pick(rng, ["GET"] * 6 + ["POST", "HEAD", "get", "\0", "CONNECT"])
        line = f"{method} {target} HTTP/{pick(rng, ['1.1', '1.1', '1.0', '2', '0.9'])}"
        data = bytearray("\r\n".join([line, *rng.permutation(lines), "", ""]).encode())
        for _ in range(pick(rng, [0, 0, 1, 5, 50])):
            data[int(rng.integers(len(data)))] = int(rng.integers(256))
        taken |= send_and_judge(browser, bytes(data))
    return taken


def strangers(rng, browser):
    """Requests that lack one thing that lets them in."""
    for target in ("/", "/download/run.nc", "/socket"):
        lacks = [
            {
                "Cookie": pick(
                    rng, [None, "a=b", browser.cookie[:-1], browser.cookie.upper(), "=;;="]
                )
            },
            {
                "Host": pick(
                    rng, [None, "evil.example", "127.0.0.1", f"evil:{browser.port}", "\xff"]
                )
            },
            {"Sec-Fetch-Site": pick(rng, ["cross-site", "same-site", "", "NONE"])},
        ]
        got = browser.get(target, **pick(rng, lacks))
        judged(got, entitled=False)
    origin = pick(rng, [None, "null", "http://evil.example", f"https://{browser.host}", ""])
    return judged(browser.raw(browser.handshake(Origin=origin)), entitled=False)


def paths(rng, browser):
    """Paths that lead out of where something is, written in many ways."""
    for _ in range(20):
        parts = "".join(pick(rng, PATHS) for _ in range(rng.integers(1, 8)))
        start = pick(rng, ["/", "/download/", "/download", "", "/socket/", "file:///", "http://x/"])
        if f"{start}{parts}" not in ("/", "/download/run.nc"):
            judged(browser.get(f"{start}{parts}etc/passwd"[: int(rng.integers(1, 90))]), True)


def too_much(rng, browser):
    """Long lines, many headers, and bodies."""
    size = int(rng.integers(5_000, 300_000))
    start = f"GET / HTTP/1.1\r\nHost: {browser.host}\r\n"
    data = [
        f"GET /{'a' * size} HTTP/1.1\r\n\r\n",
        f"{start}A: {'a' * size}\r\n\r\n",
        start + "A: b\r\n" * size,
        f"POST / HTTP/1.1\r\nHost: {browser.host}\r\nContent-Length: {size}\r\n\r\n{'a' * size}",
        "a" * size,
        "\r\n" * size,
    ]
    return send_and_judge(browser, pick(rng, data).encode(), entitled=False)


def odd_frames(rng, browser):
    """Frames of any kind, masked with zeros or not, with wrong bits and lengths."""
    for _ in range(5):
        body = rng.bytes(rng.integers(126))
        first = int(rng.integers(2)) << 7 | int(rng.integers(16))
        data = bytearray([first, 0x80 | len(body), 0, 0, 0, 0, *body])
        for _ in range(pick(rng, [0, 0, 1, 10])):
            data[int(rng.integers(len(data)))] = int(rng.integers(256))
        spoken(browser, [bytes(data)] * int(rng.integers(1, 30)))


def odd_messages(rng, browser):
    """Texts that are nearly JSON."""
    whole = json.dumps({"set": "task.gain", "value": [1, -2.5, None, {"a": "\U0001f916"}]})
    for _ in range(5):
        text = bytearray(whole.encode() * pick(rng, [1, 1, 3, 900]))
        for _ in range(pick(rng, [0, 1, 3])):
            text[int(rng.integers(len(text)))] = pick(rng, list(b'{}[]",:\\0-eNI\0\xff'))
        deep = pick(rng, [b'{"a":', b"[", b'{"a":[', b'"\\ud800'])
        odd = pick(rng, [bytes(text), deep * int(rng.integers(1, 9_000))])
        spoken(browser, [Frame(Opcode.TEXT, odd).serialize(mask=True)] * 3)


def endless(rng, browser):
    """A message in fragments, empty or not, that never ends."""
    size = pick(rng, [0, 1, 1000, 60_000])
    first = Frame(Opcode.TEXT, b"a", fin=False).serialize(mask=True)
    more = Frame(Opcode.CONT, bytes(size), fin=False).serialize(mask=True)
    return spoken(browser, [first, *[more] * 500])


def spoken(browser, frames):
    """Shake hands, send frames, and read for a moment what comes."""
    with suppress(ConnectionError, TimeoutError), browser.connected() as stream:
        stream.sendall(browser.handshake())
        if not stream.recv(12).startswith(b"HTTP/1.1 101"):
            return False
        for each in frames:
            stream.sendall(each)
        end = time.monotonic() + 0.1
        while time.monotonic() < end and stream.recv(1 << 20):
            pass  # bytes that are unread at the close discard the answer
    return True


def slowly(rng, browser):
    """Twenty connections that send a byte now and then; some send nothing."""
    words = pick(rng, [browser.handshake(), b"GET / HTTP/1.1\r\nHost: ", b"\r" * 99])
    with ExitStack() as held:
        streams = [held.enter_context(browser.connected()) for _ in range(20)]
        for byte in words[: int(rng.integers(2, 60))]:
            for each in streams:
                with suppress(ConnectionError):
                    each.sendall(bytes([byte]))
            time.sleep(0.01)


def crowd(rng, browser):
    """Twenty pages: some read all, some stop reading, and all go without a word."""
    with ExitStack() as held:
        pages = [held.enter_context(browser.connected()) for _ in range(20)]
        for each in pages:
            each.sendall(browser.handshake())
            each.settimeout(0.01)
        end = time.monotonic() + rng.uniform(0.2, 2.0)
        while time.monotonic() < end:
            for each in pages[: int(rng.integers(21))]:
                with suppress(TimeoutError, ConnectionError):
                    each.recv(1 << 20)
    return True


KINDS = [odd_requests, strangers, paths, too_much, odd_frames, odd_messages, endless, slowly, crowd]
