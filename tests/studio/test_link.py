"""What a page and the app say to each other, and how much of it is kept and waited for."""

import json
import socket
import threading
import time
from contextlib import suppress

import pytest
from studio.fake import Browser, Fake, answer, closed, everything
from websockets.exceptions import ConnectionClosed
from websockets.frames import Frame, Opcode

from robsim.studio import limits
from robsim.studio.messages import BadMessage, Budget, parsed
from robsim.studio.outbox import Outbox, framed
from robsim.studio.server import Server

OBJECT = "a message is a JSON object, such as {...}"
JSON = "a message is JSON in UTF-8, and this is not"
FINITE = "the numbers in a message are finite"
DEEP = "a message nests at most 16 deep"
WHOLE = "a whole number in a message is at most 9007199254740992"
BAD = {
    **dict.fromkeys(["", "{", "{'a': 1}", "nul", '{"a": 01}', "{}{}", '{"a": "\\ud800"}'], JSON),
    **dict.fromkeys(["1", "null", "[{}]", '"a"'], OBJECT),
    **dict.fromkeys(['{"a": NaN}', '{"a": -Infinity}', '{"a": [1e999]}'], FINITE),
    **dict.fromkeys(['{"a": 9007199254740993}', '{"a": 1%s}' % ("0" * 9000)], WHOLE),
    **dict.fromkeys(["[" * 60_000, '{"a":' * 9000 + "1" + "}" * 9000], DEEP),
    '{"a":' * 16 + "[]" + "}" * 16: DEEP,
}


def masked(opcode, data=b"", fin=True):
    return Frame(opcode, data, fin).serialize(mask=True)


def test_every_page_is_told_how_things_are_and_then_what_is_new(server, browser):
    with browser.page() as one, browser.page() as two:
        server.broadcast("both")
        server.broadcast(b"\1\2")
        assert [one.recv(20), one.recv(20)] == [two.recv(20), two.recv(20)] == ["both", b"\1\2"]


def test_an_answer_is_for_the_page_that_asked(server, browser, app):
    with browser.page() as one, browser.page() as two:
        one.send('{"say": "caf\\u00e9 \U0001f916", "at": [1, -2.5e-3, true, null]}')
        said = {"say": "café \U0001f916", "at": [1, -2.5e-3, True, None]}
        assert json.loads(one.recv(20)) == said and app.heard == [said]
        one.send('{"answer": false}')
        one.send('{"last": 1}')
        assert one.recv(20) == '{"last": 1}'
        server.broadcast("next")
        assert two.recv(20) == "next"


@pytest.mark.parametrize("message", BAD, ids=lambda text: text[:20])
def test_what_is_no_message_is_answered_in_words_and_the_talk_goes_on(browser, app, message):
    with browser.page() as page:
        page.send(message)
        assert json.loads(page.recv(20)) == {"error": BAD[message]}
        page.send('{"a": 1}')
        assert page.recv(20) == '{"a": 1}' and app.heard == [{"a": 1}]


def test_bytes_are_no_message(browser):
    with browser.page() as page:
        page.send(b'{"a": 1}')
        assert json.loads(page.recv(20))["error"] == "a message is text, and this is binary"
        page.send(b"\xff\xfe", text=True)
        assert json.loads(page.recv(20))["error"] == JSON


def test_messages_nest_as_deep_as_is_said():
    deep = parsed(b'{"a":' * 15 + b"[1]" + b"}" * 15)
    for _ in range(15):
        deep = deep["a"]
    assert deep == [1]
    with pytest.raises(BadMessage, match=DEEP):
        parsed(b'{"a":' * 15 + b"[[]]" + b"}" * 15)


def test_a_page_that_goes_on_with_nonsense_is_not_listened_to(browser):
    with browser.page() as page:
        for _ in range(limits.BAD):
            page.send("nonsense")
        assert closed(page) == (1008, "too many malformed messages")


def test_a_message_has_a_largest_size_in_one_frame_or_many(browser, app):
    rest = limits.MESSAGE - len('{"a": ""}')
    whole = '{"a": "%s"}' % ("b" * rest)
    with browser.page() as page:
        page.send(whole)
        page.send([whole[:9], "", whole[9:]])
        assert page.recv(20) == page.recv(20) == whole
        page.send(whole + " ")
        assert closed(page)[0] == 1009
    with browser.page() as page:
        with suppress(ConnectionClosed):
            page.send("b" * 1000 for _ in range(200))
        assert closed(page)[0] == 1009
    assert len(app.heard) == 2


def test_a_page_may_say_so_much_a_second():
    budget = Budget()
    assert [budget.spend(7.0) for _ in range(401)] == [True] * 400 + [False]
    budget = Budget()
    assert all(budget.spend(i / 200) for i in range(2000))
    assert sum(budget.spend(10 + i / 400) for i in range(2000)) < 1200


@pytest.mark.parametrize("opcode", [Opcode.TEXT, Opcode.PING, Opcode.PONG, Opcode.CONT])
def test_a_page_that_says_too_much_is_closed_whatever_it_says(browser, opcode):
    with browser.connected() as stream:
        stream.sendall(browser.handshake())
        first = masked(Opcode.TEXT, b"{", fin=False) if opcode is Opcode.CONT else b""
        data = b'{"answer": false}' if opcode is Opcode.TEXT else b""
        stream.sendall(first + masked(opcode, data, opcode is not Opcode.CONT) * 500)
        said = everything(stream)
    assert said.endswith(b"\x03\xf0more than 200 messages a second")


@pytest.mark.parametrize(
    "data",
    [
        *(b"\x81\x02{}", b"\xc1\x80abcd", b"\x83\x80abcd", b"\x80\x80abcd", b"\x09\x80abcd"),
        *(
            b"\x89\xfe\x00\x7eabcd" + bytes(126),
            b"\x81\xff\xff" + b"\xff" * 7,
            b"\x88\x81abcd\0",
            b"GET / HTTP",
        ),
    ],
)
def test_what_is_no_frame_ends_the_talk(browser, data):
    with browser.connected() as stream:
        stream.sendall(browser.handshake() + data)
        assert b"\x88" in everything(stream).partition(b"\0numbers")[2]
    with browser.page() as page:  # the others
        page.send("{}")
        assert page.recv(20) == "{}"


@pytest.mark.parametrize(
    "wrong",
    [
        *({"Sec-WebSocket-Key": "x"}, {"Sec-WebSocket-Version": "8"}, {"Connection": "close"}),
        *({"Upgrade": "h2c"}, {"Sec-WebSocket-Key": None}, {"Content-Length": "5"}),
    ],
)
def test_what_is_no_handshake_is_refused(browser, wrong):
    got = browser.raw(browser.handshake(**wrong))
    assert (got.status, got.body) == (400, b"This is not the handshake of a WebSocket.\n")


def test_what_fails_inside_is_logged_once_and_the_talk_goes_on(caplog):
    app = Fake(fails=("receive",))
    with Server(app) as server, Browser(server).page() as page:
        for _ in range(3):
            page.send("{}")
            words = "internal error; the command's own output says more"
            assert json.loads(page.recv(20)) == {"error": words}
        app.fails = ()
        page.send('{"a": 1}')
        assert page.recv(20) == '{"a": 1}'
    assert len(caplog.records) == 1 and "a secret" in caplog.text


def test_a_page_that_cannot_be_greeted_is_closed(caplog):
    with Server(Fake(fails=("hello",))) as server, Browser(server).silent_page() as page:
        assert closed(page) == (1011, "internal error; the command's own output says more")
    assert len(caplog.records) == 1 and "a secret" in caplog.text


def test_more_pages_than_it_takes_are_refused_in_words(browser, monkeypatch):
    monkeypatch.setattr(limits, "PAGES", 1)
    with browser.page():
        got = browser.raw(browser.handshake())
        assert (got.status, got.body) == (
            503,
            b"Too many pages are open; close one and try again.\n",
        )
    with browser.page() as page:
        page.send("{}")
        assert page.recv(20) == "{}"


def test_an_outbox_keeps_the_order_and_drops_all_when_it_is_full():
    box = Outbox()
    box.put(b"before it was greeted")
    assert box.take() is None and box.start_anew() and not box.start_anew()
    for i in range(limits.QUEUE):
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
    large = bytes(limits.QUEUE_BYTES + 1)
    box.put(large)
    assert box.take() is large
    half = bytes(limits.QUEUE_BYTES // 2)
    for _ in range(5):
        box.put(half)
        box.put(half)
        assert box.take() is half and box.take() is half
    box.put(half)
    box.put(large)
    assert box.take() is None and box.start_anew()


def test_frames_are_those_of_the_protocol():
    assert framed("é") == b"\x81\x02\xc3\xa9" and framed(b"\0") == b"\x82\x01\0"


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


def test_what_a_slow_page_reads_is_not_old(server, browser):
    """Beyond a frame that has begun, only what the system holds lies before the present."""
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


def test_who_broadcasts_waits_for_nobody_even_where_the_app_does(server, browser, app):
    begun, held, waited = threading.Event(), threading.Event(), []
    app.receive = lambda message: begun.set() or waited.append(held.wait(20))
    with browser.page() as page:
        page.send("{}")
        assert begun.wait(20)
        for _ in range(1000):
            server.broadcast(bytes(100_000))
        held.set()
        while page.recv(20) != "hello 2":
            pass
        assert waited == [True]


def test_a_page_that_reads_nothing_is_dropped(server, browser, monkeypatch):
    monkeypatch.setattr(limits, "PATIENCE", 0.2)
    monkeypatch.setattr(limits, "PAGES", 1)
    with browser.connected() as stuck:
        stuck.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        stuck.sendall(browser.handshake())
        assert browser_is_let_in(server, browser)


def test_a_page_of_which_nothing_is_heard_is_dropped(server, browser, monkeypatch):
    monkeypatch.setattr(limits, "PATIENCE", 1.0)
    monkeypatch.setattr(limits, "PING", 0.05)
    with browser.page() as page, browser.connected() as silent:
        silent.sendall(browser.handshake())
        assert everything(silent).count(framed("").replace(b"\x81", b"\x89")) >= 2
        page.send("{}")  # whose browser has answered the pings
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
