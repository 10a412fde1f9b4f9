"""A server of an app without a simulation, and one who looks at it."""

import pytest
from studio.fake import Browser, Fake

from robsim.studio.web.server import Server


@pytest.fixture
def app():
    return Fake()


@pytest.fixture
def server(app):
    with Server(app) as server:
        yield server


@pytest.fixture
def browser(server):
    return Browser(server)
