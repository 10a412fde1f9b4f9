"""The queue of a page is short, and the simulation waits for nobody."""

import socket
import threading
import time

import pytest
from studio.fake import answer, everything

from robsim.studio.web import server_limits
from robsim.studio.web.outbox import Outbox, encode_websocket_frame


def test_an_outbox_keeps_the_order_and_drops_all_when_it_is_full():
    box = Outbox()
    box.put(b"before it was greeted")
    assert box.take() is None and box.start_anew() and not box.start_anew()
    for i in range(server_limits.QUEUE):
        box.put(b"%d" % i)
    assert [box.take(), box.take()] == [b"0", b"1"]
    for i in range(3):
        box.put(b"%d" % i)
    assert box.take() is None and box.start_anew()
    box.put(b"new")
    assert box.take() == b"new" and box.take() is None


def test_an_outbox_counts_bytes_and_lets_one_frame_of_any_size_pass():
    box = Outbox()
    box.start_anew()
    large = bytes(server_limits.QUEUE_BYTES + 1)
    box.put(large)
    assert box.take() is large
    half = bytes(server_limits.QUEUE_BYTES // 2)
    for _ in range(5):
        box.put(half)
        box.put(half)
        assert box.take() is half and box.take() is half
    box.put(half)
    box.put(large)
    assert box.take() is None and box.start_anew()


def test_frames_agree_with_the_protocol():
    assert (
        encode_websocket_frame("é") == b"\x81\x02\xc3\xa9"
        and encode_websocket_frame(b"\0") == b"\x82\x01\0"
    )


def test_a_page_that_falls_behind_comes_to_the_present_when_it_reads_again(server, browser, app):
    with browser.page() as other, browser.silent_page(max_queue=1) as slow:
        for i in range(300):
            server.broadcast(bytes([i % 256]) * 100_000)
            assert other.recv(20)[0] == i % 256  # all of it, at its own pace
        server.broadcast("last")
        got = [slow.recv(20)]
        while len(got) < 3 or not str(got[-2]).startswith("hello"):
            got.append(slow.recv(20))
        assert len(got) < 200 and got[0].startswith("hello") and app.hellos >= 3
        server.broadcast("after")
        while slow.recv(20) != "after":
            pass


def test_messages_that_a_slow_page_reads_are_not_old(server, browser):
    """After a frame that has begun, only the buffer of the system comes before the present."""
    with browser.connected() as slow, browser.page() as other:
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65_536)
        slow.sendall(browser.handshake())
        for _ in range(100):
            server.broadcast(bytes(100_000))
            assert len(other.recv(20)) == 100_000
        read = bytearray(slow.recv(1000))
        while b"hello 3" not in read[-70_000:]:
            read += slow.recv(65_536)
    assert len(read) < 1_200_000


def test_a_broadcast_waits_for_nobody_even_if_the_app_does(server, browser, app, monkeypatch):
    begun, held, waited = threading.Event(), threading.Event(), []
    app.receive = lambda message: begun.set() or waited.append(held.wait(20))
    with browser.page() as page:
        page.send("{}")
        assert begun.wait(20)
        calls, call = [], server._loop.call_soon_threadsafe
        monkeypatch.setattr(
            server._loop, "call_soon_threadsafe", lambda what: calls.append(call(what))
        )
        for _ in range(1000):
            server.broadcast(bytes(100_000))
        assert len(calls) == 1  # and no heap of them
        monkeypatch.undo()
        held.set()
        while page.recv(20) != "hello 2":
            pass
        assert waited == [True]


def test_a_page_that_reads_nothing_is_dropped(server, browser, monkeypatch):
    monkeypatch.setattr(server_limits, "PATIENCE", 0.2)
    monkeypatch.setattr(server_limits, "PAGES", 1)
    with browser.connected() as stuck:
        stuck.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        stuck.sendall(browser.handshake())
        assert browser_is_let_in(server, browser)


@pytest.mark.full
def test_a_page_of_which_nothing_is_heard_is_dropped(server, browser, monkeypatch):
    monkeypatch.setattr(server_limits, "PATIENCE", 1.0)
    monkeypatch.setattr(server_limits, "PING", 0.05)
    with browser.page() as page, browser.connected() as silent:
        silent.sendall(browser.handshake())
        assert everything(silent).count(encode_websocket_frame("").replace(b"\x81", b"\x89")) >= 2
        page.send("{}")  # the browser of this page has answered the pings
        assert page.recv(20) == "{}"


def browser_is_let_in(server, browser):
    """Send a lot to all; return whether another page has a place within some seconds."""
    end = time.monotonic() + 20
    while time.monotonic() < end:
        server.broadcast(bytes(100_000))
        with browser.connected() as stream:
            stream.sendall(browser.handshake())
            if answer(stream.recv(1000)).status == 101:
                return True
        time.sleep(0.02)
    return False
