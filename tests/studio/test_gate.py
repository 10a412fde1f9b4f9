"""Who may come in: a token that becomes a cookie, names of ours, and no other page."""

import http.client

import pytest
from studio.fake import PAGE, Browser, Fake
from websockets.datastructures import Headers
from websockets.exceptions import InvalidStatus
from websockets.http11 import Request

from robsim.base.errors import InputError
from robsim.studio.web.access_gate import AccessGate
from robsim.studio.web.http_responses import RefusedRequest
from robsim.studio.web.server import Server

ASK = b"Open the address that the command printed, with its token.\n"
EVERYWHERE = ["/", "/download/run.nc", "/socket", "/nothing"]


def test_the_token_becomes_a_cookie_and_leaves_the_address_bar(browser):
    got = browser.get(f"/?token={browser.token}", Cookie=None)
    assert (got.status, got.headers["location"]) == (303, "/")
    cookie, *rules = got.headers["set-cookie"].split("; ")
    assert cookie == f"robsim_{browser.port}={browser.token}"
    assert sorted(rules) == ["HttpOnly", "Path=/", "SameSite=Strict"]
    assert browser.get("/", Cookie=f"other=1; {cookie}; last=2").body == PAGE.encode()


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_a_link_in_another_page_loads_the_page_by_an_answer_of_ours(browser, site):
    """Behind a redirect, browsers take the other page for the origin of the request."""
    got = browser.get(f"/?token={browser.token}", Cookie=None, Sec_Fetch_Site=site)
    assert (got.status, got.headers["refresh"]) == (200, "0; url=/")
    assert got.headers["set-cookie"].startswith(browser.cookie) and "location" not in got.headers


@pytest.mark.parametrize("target", EVERYWHERE)
@pytest.mark.parametrize("cookie", [None, "", "robsim=1", "robsim_{port}=", "robsim_{port}=\xe9"])
def test_without_the_cookie_there_is_nothing(browser, target, cookie):
    got = browser.get(target, Cookie=cookie and cookie.format(port=browser.port))
    assert (got.status, got.body) == (403, ASK)


@pytest.mark.parametrize("cut", [slice(0), slice(-1), slice(1, None)])
def test_another_token_gives_no_cookie(browser, cut):
    for token in (browser.token[cut], browser.token + "A", "é".encode().decode("latin-1")):
        got = browser.get(f"/?token={token}")
        assert got.status in (400, 403) and "set-cookie" not in got.headers


def test_the_cookie_of_another_studio_does_not_serve(browser):
    with Server(Fake()) as other:
        theirs = Browser(other)
        assert theirs.token != browser.token
        assert browser.get("/", Cookie=theirs.cookie).status == 403
        assert browser.get("/", Cookie=f"{theirs.cookie}; {browser.cookie}").status == 200


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost", "LocalHost", "[::1]"])
def test_names_of_this_machine_are_ours(browser, name):
    assert browser.get("/", Host=f"{name}:{browser.port}").body == PAGE.encode()


@pytest.mark.parametrize(
    "name",
    [
        *("evil.example:{port}", "127.0.0.1", "localhost:1", "localhost.:{port}", "x@localhost"),
        *("127.0.0.1.evil.example:{port}", "192.168.0.7:{port}", "[::]:{port}", ":{port}", ""),
        *("localhost:{port}:{port}", "127.0.0.1:0{port}", "127.1:{port}", None),
    ],
)
@pytest.mark.parametrize("target", ["/", "/?token={token}"])
def test_other_names_are_not_ours_whoever_asks(browser, name, target):
    got = browser.get(
        target.format(token=browser.token), Host=name and name.format(port=browser.port)
    )
    assert (got.status, got.body) == (403, b"This is the name of another host. " + ASK)


def test_a_second_host_is_refused(browser):
    lines = f"GET / HTTP/1.1\r\nHost: {browser.host}\r\nHost: evil\r\nCookie: {browser.cookie}"
    assert browser.raw(f"{lines}\r\n\r\n".encode()).status == 400


@pytest.mark.parametrize("target", EVERYWHERE)
@pytest.mark.parametrize("site", ["cross-site", "same-site", "odd"])
def test_what_another_page_asks_for_it_does_not_get(browser, target, site):
    got = browser.get(target, Sec_Fetch_Site=site)
    assert (got.status, got.body) == (403, b"The request comes from another page. " + ASK)


@pytest.mark.parametrize("site", ["none", "same-origin", None])
def test_our_page_and_a_person_get_their_requests(browser, site):
    assert browser.get("/", Sec_Fetch_Site=site).body == PAGE.encode()


@pytest.mark.parametrize(
    "origin",
    [None, "null", "http://evil.example", "https://{host}", "http://{host}.evil", "http://{host}/"],
)
def test_a_socket_of_another_page_is_refused(browser, origin):
    with browser.connected() as stream:
        stream.sendall(browser.handshake(Origin=origin and origin.format(host=browser.host)))
        got = http.client.HTTPResponse(stream)
        got.begin()
        assert (got.status, got.read()) == (403, b"The request comes from another page. " + ASK)


def test_a_socket_needs_the_cookie_and_the_origin_of_its_own_host(browser):
    for wrong in (
        {"headers": {"Cookie": "robsim=1"}},
        {"origin": f"http://localhost:{browser.port}"},
    ):
        with pytest.raises(InvalidStatus) as refused, browser.silent_page(**wrong):
            pass
        assert refused.value.response.status_code == 403


def passes(gate, host, cookie):
    try:
        gate.check(Request("/", Headers(host=host, cookie=cookie)))
    except RefusedRequest:
        return False
    return True


def test_behind_all_addresses_only_numbers_and_the_machines_own_name_are_ours():
    """A number cannot be a name that somebody made to point here."""
    gate = AccessGate("0.0.0.0", 8000)
    name, token = gate.address.removeprefix("http://").split(":8000/?token=")
    taken = [
        host
        for host in (name, "192.168.0.7", "[fe80::1]", "localhost", "evil.example", "1.2.3", "")
        if passes(gate, f"{host}:8000", f"robsim_8000={token}")
    ]
    assert taken == [name, "192.168.0.7", "[fe80::1]", "localhost"]
    assert not passes(gate, "192.168.0.7:8001", f"robsim_8000={token}")


def test_a_host_that_was_given_is_ours_and_port_80_is_left_out():
    gate = AccessGate("Lab.example", 80)
    assert gate.address.startswith("http://lab.example/?token=")
    cookie = f"robsim_80={gate.address.split('=')[1]}"
    assert passes(gate, "lab.EXAMPLE", cookie) and not passes(gate, "lab.example:8000", cookie)
    assert AccessGate("::1", 8000).address.startswith("http://[::1]:8000/")


def test_other_machines_are_let_in_only_by_a_word():
    with pytest.raises(InputError, match=r"can reach host '0\.0\.0\.0': pass --allow"):
        Server(Fake(), host="0.0.0.0")
    with Server(Fake(), host="0.0.0.0", allow_remote=True) as server:
        assert "may watch and control this simulation" in server.exposed
        assert "not encrypted" in server.exposed
        assert Browser(server).get("/").status == 200
    with Server(Fake(), allow_remote=True) as server:
        assert server.exposed == ""


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"host": ""}, "host: expected a name or an IP address, got ''"),
        ({"host": 7}, "address, got 7"),
        ({"host": "x..y"}, "unknown host 'x..y'"),
        ({"port": -1}, "port: expected a whole number from 0 to 65535, got -1"),
        ({"port": 2**16}, "65535, got 65536"),
        ({"port": "80"}, "65535, got '80'"),
        ({"port": 80.5}, "65535, got 80.5"),
    ],
)
def test_an_invalid_place_to_listen_is_refused_in_words(given, words):
    with pytest.raises(InputError) as refused:
        Server(Fake(), **given)
    assert words in str(refused.value)


def test_a_port_that_is_taken_is_refused_in_words(browser):
    with pytest.raises(InputError, match=f"cannot listen on 127.0.0.1, port {browser.port}: Addr"):
        Server(Fake(), port=browser.port)
