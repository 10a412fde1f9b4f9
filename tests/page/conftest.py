"""A real browser, with graphics in software and without a network."""

import os
import re
import shutil
import subprocess

import pytest
from page.desk import open_desk
from page.drivers import FirefoxDriver
from page.tabs import Tabs, heed_console
from page.waiting import until

import robsim as rs
from robsim.page.export import export_html

SWITCHES = (
    "--no-sandbox",
    "--enable-unsafe-swiftshader",  # for WebGL alone; texts and curves are drawn faster without it
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)


@pytest.fixture(scope="session")
def playwright():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        yield driver


@pytest.fixture(scope="session")
def chromium(playwright):
    """Chromium, driven by Playwright."""
    browser = launched(playwright)
    yield browser
    browser.close()


@pytest.fixture
def desk(chromium):
    """A studio of ViSP's tutorial case."""
    with open_desk(chromium, rs.load_scenario(rs.examples.path("visp_tutorial"))) as made:
        yield made


def launched(playwright, *switches):
    path = shutil.which("chromium")
    return playwright.chromium.launch(executable_path=path, args=[*SWITCHES, *switches])


@pytest.fixture
def chromium_flat(playwright):
    """Open an address in a Chromium that has no 3-D graphics."""
    browser = launched(playwright, "--disable-3d-apis")

    def open_page(address):
        page = browser.new_page(reduced_motion="reduce", offline=True)
        page.goto(address)
        until(page, "document.body.dataset.ready")
        return page

    yield open_page
    browser.close()


@pytest.fixture
def firefox_driver(tmp_path):
    """A tab of Firefox on a virtual screen."""
    from websockets.sync.client import connect

    (tmp_path / "user.js").write_text('user_pref("webgl.force-enabled", true);\n')
    reading, writing = os.pipe()
    screen = ("-screen", "0", "1280x800x24", "-displayfd", str(writing))
    xvfb = subprocess.Popen(["Xvfb", *screen], pass_fds=[writing], stderr=subprocess.DEVNULL)
    display = f":{os.read(reading, 10).decode().strip()}"
    own = {
        "HOME": str(tmp_path),
        "DISPLAY": display,
        "MOZ_X11_EGL": "1",
        "PATH": os.environ["PATH"],
    }
    browser = subprocess.Popen(
        ["firefox-esr", "--no-remote", "--profile", tmp_path, "--remote-debugging-port", "0"],
        stderr=subprocess.PIPE,
        text=True,
        env=own,
    )
    said = iter(browser.stderr.readline, "")
    listening = (re.search(r"listening on (ws://\S+)", line) for line in said)
    address = next(found[1] for found in listening if found)
    with connect(f"{address}/session", max_size=None) as socket:
        yield FirefoxDriver(socket)
    for process in (browser, xvfb):
        process.kill()
        process.wait()
    browser.stderr.close()
    os.close(reading)
    os.close(writing)


@pytest.fixture
def firefox(firefox_driver):
    """Open an address in Firefox, and return a picture of it as PNG once it is ready."""

    def see(address, ready):
        firefox_driver.open(address)
        for _ in range(100):
            if firefox_driver.evaluate(ready):
                firefox_driver.wait(0.5)  # a frame or two
                return firefox_driver.take_picture()
            firefox_driver.wait(0.1)
        raise AssertionError(f"never true in Firefox: {ready}")

    return see


@pytest.fixture
def opened(chromium):
    """Open an address without a network; fail if the page complains or requests more files."""
    complaints = []
    tabs = Tabs(
        chromium,
        console=heed_console(complaints),
        pageerror=lambda error: complaints.append(str(error)),
    )

    def open_page(address, **options):
        def heed(asked):
            if asked.url != address:
                complaints.append(asked.url)

        page = tabs.take({"request": heed}, **options, offline=True)
        page.goto(address)
        until(page, "document.body.dataset.ready")
        return page

    yield open_page
    tabs.leave()
    assert not complaints


@pytest.fixture(scope="session")
def demo_page(tmp_path_factory):
    """The page of the demo."""
    run = rs.load_scenario(rs.examples.path("chapter_6_1")).run()
    return export_html(run, tmp_path_factory.mktemp("page") / "demo.html")
