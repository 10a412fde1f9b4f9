"""Pages of a studio, which are watched while they are used."""

from contextlib import contextmanager

from page.tabs import Tabs, heed_console
from page.waiting import until

from robsim.studio.studio import studio

# where the ball of a handle is in the window, in pixels
BALL = """(name) => {
  const { space } = robsim.view;
  const p = robsim.handles.balls.get(name).position.clone().project(space.camera);
  const box = space.renderer.domElement.getBoundingClientRect();
  return [box.left + ((p.x + 1) / 2) * box.width, box.top + ((1 - p.y) / 2) * box.height];
}"""


class Desk:
    """Pages of a studio, which may send requests to their server alone, and complain of nothing."""

    def __init__(self, browser, server):
        self.server, self.complaints = server, []
        self.tabs = Tabs(
            browser,
            console=heed_console(self.complaints),
            pageerror=lambda error: self.complaints.append(str(error)),
            request=lambda asked: self.heed(asked.url),
        )
        self.origin = server.address.partition("?")[0]

    @property
    def app(self):
        """The session of the server."""
        return self.server._app

    def page(self, **options):
        page = self.tabs.take(**options, accept_downloads=True)
        page.goto(self.server.address)
        until(page, "document.body.dataset.ready")
        return page

    def heed(self, url):
        if not url.startswith((self.origin, self.origin.replace("http", "ws"), "blob:")):
            self.complaints.append(url)


@contextmanager
def open_desk(browser, *shown):
    """Serve an experiment, a study or a robot; at the end no page may have complained."""
    with studio(*shown) as server:
        desk = Desk(browser, server)
        yield desk
        desk.tabs.leave()
    assert not desk.complaints
