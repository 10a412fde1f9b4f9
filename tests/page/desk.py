"""Pages of a studio, which are watched while they are used."""

from contextlib import contextmanager

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
        self.browser, self.server, self.complaints, self.contexts = browser, server, [], []
        self.origin = server.address.partition("?")[0]

    @property
    def app(self):
        """The session of the server."""
        return self.server._app

    def page(self, **options):
        look = {"viewport": {"width": 1280, "height": 800}, "reduced_motion": "reduce"}
        context = self.browser.new_context(**{**look, **options}, accept_downloads=True)
        self.contexts.append(context)
        page = context.new_page()
        page.on("console", lambda said: self.complaints.append(said.text))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda asked: self.heed(asked.url))
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
        for context in desk.contexts:
            context.close()
    assert not desk.complaints
