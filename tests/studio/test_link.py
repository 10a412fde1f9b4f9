"""The messages between a page and the app; messages that are too frequent, too long or wrong."""

import json
from contextlib import suppress

import pytest
from studio.fake import Browser, Fake, closed, everything
from websockets.exceptions import ConnectionClosed
from websockets.frames import Frame, Opcode

from robsim.studio.web import server_limits
from robsim.studio.web.page_messages import BadMessage, MessageBudget, parse_page_message
from robsim.studio.web.server import Server

OBJECT = "a message must be a JSON object, such as {...}"
JSON = "a message must be JSON in UTF-8"
FINITE = "the numbers in a message must be finite"
DEEP = "a message must nest at most 16 deep"
WHOLE = "a whole number in a message must be at most 9007199254740992"
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


def test_every_page_receives_the_present_state_and_then_the_news(server, browser):
    with browser.page() as one, browser.page() as two:
        server.broadcast("both")
        server.broadcast(b"\1\2")
        assert [one.recv(20), one.recv(20)] == [two.recv(20), two.recv(20)] == ["both", b"\1\2"]


def test_an_answer_goes_to_the_page_of_the_request(server, browser, app):
    with browser.page() as one, browser.page() as two:
        one.send('{"say": "caf\\u00e9 \U0001f916", "at": [1, -2.5e-3, true, null]}')
        options = {"say": "café \U0001f916", "at": [1, -2.5e-3, True, None]}
        assert json.loads(one.recv(20)) == options and app.heard == [options]
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
        assert json.loads(page.recv(20))["error"] == "a message must be text, not binary"
        page.send(b"\xff\xfe", text=True)
        assert json.loads(page.recv(20))["error"] == JSON


def test_messages_nest_as_deep_as_is_reported():
    deep = parse_page_message(b'{"a":' * 15 + b"[1]" + b"}" * 15)
    for _ in range(15):
        deep = deep["a"]
    assert deep == [1]
    with pytest.raises(BadMessage, match=DEEP):
        parse_page_message(b'{"a":' * 15 + b"[[]]" + b"}" * 15)


def test_a_page_that_goes_on_with_nonsense_is_not_listened_to(browser):
    with browser.page() as page:
        for _ in range(server_limits.BAD):
            page.send("nonsense")
        assert closed(page) == (1008, "too many malformed messages")


def test_a_message_has_a_largest_size_in_one_frame_or_many(browser, app):
    rest = server_limits.MESSAGE - len('{"a": ""}')
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


def test_the_rate_of_messages_of_a_page_is_limited():
    budget = MessageBudget()
    assert [budget.spend(7.0) for _ in range(401)] == [True] * 400 + [False]
    budget = MessageBudget()
    assert all(budget.spend(i / 200) for i in range(2000))
    assert sum(budget.spend(10 + i / 400) for i in range(2000)) < 1200


@pytest.mark.parametrize("opcode", [Opcode.TEXT, Opcode.PING, Opcode.PONG, Opcode.CONT])
def test_a_page_that_sends_too_much_is_closed_whatever_it_sends(browser, opcode):
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
def test_an_invalid_frame_ends_the_connection(browser, data):
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
        *({"Upgrade": "h2c"}, {"Sec-WebSocket-Key": None}),
    ],
)
def test_an_invalid_handshake_is_refused(browser, wrong):
    got = browser.raw(browser.handshake(**wrong))
    assert (got.status, got.body) == (400, b"This is not the handshake of a WebSocket.\n")


def test_what_fails_inside_is_logged_once_and_the_talk_goes_on(caplog):
    app = Fake(fails=("receive",))
    with Server(app) as server, Browser(server).page() as page:
        for _ in range(3):
            page.send("{}")
            words = "internal error; see the output of the command"
            assert json.loads(page.recv(20)) == {"error": words}
        app.fails = ()
        page.send('{"a": 1}')
        assert page.recv(20) == '{"a": 1}'
    assert len(caplog.records) == 1 and "a secret" in caplog.text


def test_a_page_that_cannot_be_greeted_is_closed(caplog):
    with Server(Fake(fails=("hello",))) as server, Browser(server).silent_page() as page:
        assert closed(page) == (1011, "internal error; see the output of the command")
    assert len(caplog.records) == 1 and "a secret" in caplog.text


def test_more_pages_than_it_takes_are_refused_in_words(browser, monkeypatch):
    monkeypatch.setattr(server_limits, "PAGES", 1)
    with browser.page():
        got = browser.raw(browser.handshake())
        assert (got.status, got.body) == (
            503,
            b"Too many pages are open; close one and try again.\n",
        )
    with browser.page() as page:
        page.send("{}")
        assert page.recv(20) == "{}"
