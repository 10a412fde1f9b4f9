"""The answers of a server to requests, and how it begins and ends."""

import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import pytest
from studio.fake import FILES, PAGE, Browser, Fake, answer, closed, everything

from robsim.studio.web import server_limits
from robsim.studio.web.server import Server

SAFE = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-store",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "connection": "close",
}
NOTHING = "default-src 'none'; frame-ancestors 'none'"


def test_the_page_has_its_own_policy_and_may_talk_to_its_server(browser):
    got = browser.get("/")
    policy = "default-src 'none'; script-src 'sha256-abc='; connect-src 'self'"
    assert got.status == 200 and got.body == PAGE.encode()
    assert got.headers == {
        **SAFE,
        "content-security-policy": f"{policy}; frame-ancestors 'none'",
        "content-type": "text/html; charset=utf-8",
        "content-length": str(len(PAGE)),
    }


def test_files_are_kept_and_never_shown(browser):
    got = browser.get("/download/run.nc")
    assert (got.status, got.body) == (200, FILES["run.nc"][1])
    assert got.headers == {
        **SAFE,
        "content-security-policy": NOTHING,
        "content-type": "application/x-netcdf",
        "content-length": str(len(got.body)),
        "content-disposition": 'attachment; filename="run.nc"',
    }
    assert browser.get("/download/a.txt").body == b""


@pytest.mark.parametrize(
    "target",
    [
        *("/nothing", "//", "/?x=1", "/index.html", "/favicon.ico", "/%2f", "/#", "/socket/../"),
        *("/download", "/download/", "/download/other.nc", "/download/RUN.NC", "/download/run.nc/"),
        *("/download/../run.nc", "/download/..", "/download/%72un.nc", "/download/run.nc%00"),
        *("/download/..%2f..%2fetc%2fpasswd", "/download/%252e%252e", "/download/..\\..\\x"),
        *("/download/run.nc?x", "/download/" + "a" * 65, "/../../etc/passwd", "/./"),
    ],
)
def test_there_is_nothing_anywhere_else(browser, target):
    got = browser.get(target)
    assert (got.status, got.body) == (404, b"There is nothing under this address.\n")
    assert got.headers["content-security-policy"] == NOTHING


@pytest.mark.parametrize("method", ["POST", "HEAD", "PUT", "DELETE", "OPTIONS", "CONNECT", "X"])
def test_only_get_is_answered(browser, method):
    got = browser.get("/", method=method, Content_Length="0")
    assert (got.status, got.headers["allow"]) == (405, "GET")
    assert got.body == b"Only GET is answered here.\n"


@pytest.mark.parametrize(
    "data",
    [
        *(b"\r\n\r\n\r\n", b"GET\r\n\r\n", b"GET /\r\n\r\n", b"GET  / HTTP/1.1\r\n\r\n"),
        *(b"get / HTTP/1.1\r\n\r\n", b"GET / HTTP/2.0\r\n\r\n", b"GET / HTTP/1.1 \r\n\r\n"),
        *(b"GET http://127.0.0.1/ HTTP/1.1\r\n\r\n", b"GET * HTTP/1.1\r\n\r\n"),
        *(b"GET \\ HTTP/1.1\r\n\r\n", b"GET /\0 HTTP/1.1\r\n\r\n", b"GET /\xe9 HTTP/1.1\r\n\r\n"),
        *(b"GET / HTTP/1.1\r\nno colon\r\n\r\n", b"GET / HTTP/1.1\r\nHost : x\r\n\r\n"),
        *(b"GET / HTTP/1.1\r\nA: x\r\n folded\r\n\r\n", b"GET / HTTP/1.1\r\nA: \0\r\n\r\n"),
        *(b"GET / HTTP/1.1\r\nA: x\nHost: y\r\n\r\n", b"\x16\x03\x01\x02\0\x01\r\n\r\n"),
        b"GET / HTTP/1.1\r\nContent-Length: 5\r\n\r\nhello",
        b"GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
    ],
)
def test_an_invalid_request_is_refused(browser, data):
    got = browser.raw(data)
    assert (got.status, got.body) == (400, b"This is not a request of a browser.\n")


def test_a_request_that_is_too_long_is_refused(browser):
    assert browser.get("/" + "a" * server_limits.LINE).status == 414
    assert browser.raw(b"GET /" + b"a" * 5_000_000).status == 414  # sent and heard to the end
    assert browser.get("/", A="a" * server_limits.HEAD).status == 431
    assert browser.raw(b"GET / HTTP/1.1\r\n" + b"A: b\r\n" * server_limits.HEAD).status == 431
    assert browser.get("/", A="a" * server_limits.LINE).status == 431
    assert browser.get("/", A="a" * (server_limits.LINE - 5)).status == 200
    long = {f"A{i}": "a" * 4000 for i in range(5)}
    assert browser.get("/", **long).status == 431


def test_a_request_that_does_not_end_is_not_waited_for(browser, monkeypatch):
    monkeypatch.setattr(server_limits, "HEAD_SECONDS", 0.05)
    got = browser.raw(b"GET / HTTP/1.1\r\nHost: ")
    assert (got.status, got.body) == (408, b"The request was not complete in time.\n")
    with browser.connected() as ahead, browser.connected() as gone:
        gone.shutdown(1)
        assert everything(ahead) == everything(gone) == b""


@pytest.mark.parametrize("where", ["page", "download"])
def test_what_fails_inside_stays_inside_and_is_logged_once(where, caplog):
    with Server(Fake(fails=(where,))) as server:
        browser, target = Browser(server), "/" if where == "page" else "/download/run.nc"
        for _ in range(3):
            got = browser.get(target)
            assert got.status == 500
            assert got.body == b"internal error; see the output of the command\n"
    assert [record.name for record in caplog.records] == ["robsim.studio"]
    assert "a secret" in caplog.text


def test_more_connections_than_it_takes_are_refused_and_others_come_later(browser, monkeypatch):
    monkeypatch.setattr(server_limits, "CONNECTIONS", 3)
    held = [browser.connected() for _ in range(3)]
    with browser.connected() as stream:
        got = answer(everything(stream))
    assert (got.status, got.body) == (
        503,
        b"Too many connections are open; close one and try again.\n",
    )
    held.pop().close()
    for _ in range(100):
        if (got := browser.get("/")) and got.status == 200:
            break
    assert got.body == PAGE.encode()
    for each in held:
        each.close()


def test_twenty_ask_at_the_same_time_and_each_gets_all(browser):
    with ThreadPoolExecutor(20) as pool:
        got = list(pool.map(lambda _: browser.get("/download/run.nc").body, range(40)))
    assert set(got) == {FILES["run.nc"][1]}


def test_a_reader_of_half_a_file_is_dropped_and_holds_up_nobody(browser, app, monkeypatch):
    monkeypatch.setattr(server_limits, "PATIENCE", 0.1)
    monkeypatch.setitem(FILES, "big.nc", ("application/x-netcdf", bytes(20_000_000)))
    asked = f"GET /download/big.nc HTTP/1.1\r\nHost: {browser.host}\r\nCookie: {browser.cookie}"
    held = [browser.connected() for _ in range(2 * server_limits.ANSWERS)]
    for each in held:
        each.sendall(f"{asked}\r\n\r\n".encode())
    assert browser.get("/").body == PAGE.encode()
    assert all(len(everything(each)) < 20_000_000 for each in held[: server_limits.ANSWERS])
    for each in held:
        each.close()


def ended():
    """Whether all threads of servers end."""
    for each in threading.enumerate():
        if each.name.startswith("robsim-studio"):
            each.join(2.0)
    return not any(each.name.startswith("robsim-studio") for each in threading.enumerate())


def test_the_end_comes_in_two_seconds_whatever_is_open(app):
    server = Server(app)
    browser = Browser(server)
    with ExitStack() as held:
        pages = [held.enter_context(browser.page()) for _ in range(3)]
        half, stuck, _ = [held.enter_context(browser.connected()) for _ in range(3)]
        half.sendall(b"GET / HT")
        stuck.sendall(browser.handshake())
        for _ in range(100):
            server.broadcast(bytes(100_000))
        assert browser.get("/").status == 200 and not server.wait(0)
        closing = threading.Thread(target=server.close)
        closing.start()
        assert server.wait(2.0)
        closing.join()
        assert ended()
        for each in pages:
            assert closed(each)[0] in (1001, 1006)  # one that has not read to its end hears no more
    server.close()
    server.broadcast("nobody hears this")


def test_a_page_receives_the_end_of_the_server(app):
    with Server(app) as server, Browser(server).page() as page:
        server.close()
        assert closed(page) == (1001, "the studio has ended")


def test_a_page_can_end_the_server(app, caplog):
    server = Server(app)
    app.receive = lambda message: server.close()
    with Browser(server).page() as page:
        page.send("{}")
        assert server.wait(2.0)
    server.close()
    assert ended() and not caplog.records


def test_nothing_is_left_open_in_a_process_that_looks():
    code = "from studio.fake import Browser, Fake; from robsim.studio.web.server import Server\n"
    code += "with Server(Fake()) as server, Browser(server).page() as page:\n"
    code += "    assert Browser(server).get().status == 200; page.send('{}'); server.close()"
    command = [sys.executable, "-W", "error", "-c", code]
    done = subprocess.run(command, capture_output=True, check=True, env=with_tests(), timeout=60)
    assert (done.stdout, done.stderr) == (b"", b"")


def with_tests():
    """The environment of a process that finds the fake app."""
    paths = [str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
