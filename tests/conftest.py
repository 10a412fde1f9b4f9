"""Scenes that several tests use, and which rows of a product of choices run by default."""

import gc
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
from covering import thin

import robsim as rs
from robsim import cli
from robsim.base import interrupt
from robsim.declare.kind_families import families

PUMA_ROWS = [
    [0, 0.67183, 0, np.pi / 2],
    [0, 0, 0.4318, 0],
    [0, 0.15005, 0.0203, -np.pi / 2],
    [0, 0.4318, 0, np.pi / 2],
    [0, 0, 0, -np.pi / 2],
    [0, 0, 0, 0],
]
FILES = pytest.StashKey[set[str]]()
SQUARE = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]])


ROOT = Path(__file__).parents[1]
gc.set_threshold(50_000, 20, 20)  # a collection visits all tests


def _entries():
    """Return the names in the root of the repository that no cache or build has made."""
    return {path.name for path in ROOT.iterdir() if not path.name.startswith((".", "__", "build"))}


def pytest_sessionstart(session):
    """Note the files that stand there before the first test."""
    session.config.stash[FILES] = _entries()


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session):
    """Fail if a test has left a file in the root, the folder in which the suite is started."""
    left = _entries() - session.config.stash[FILES]
    if left and not hasattr(session.config, "workerinput"):  # which processes of xdist have
        print(f"\ntests left files in {ROOT}: {', '.join(sorted(left))}", file=sys.stderr)
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


@pytest.hookimpl(tryfirst=True)  # before pytest deselects by marks
def pytest_collection_modifyitems(items):
    thin(items)


@pytest.fixture(autouse=True)
def _kinds_as_before():
    """Forget the kinds that a test registers, so that no other test meets them."""
    before = {noun: dict(family.loaded) for noun, family in families().items()}
    yield
    for noun, family in families().items():
        for name in family.loaded.keys() - family.shipped.keys():
            del family.loaded[name]
        family.loaded.update(before.get(noun, {}))


@pytest.fixture(autouse=True)
def _stops_as_before():
    """Restore the signal handlers: the command line leaves its own handler of Ctrl-C."""
    before = {number: signal.getsignal(number) for number in interrupt.SIGNALS}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def called(monkeypatch, capsys):
    """`robsim ARGUMENTS` in this process: (status, out, err)."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["robsim", *map(str, arguments)])
        status = 0
        try:
            cli.main()
        except SystemExit as stop:
            status = stop.code or 0
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return status, out, err

    return call


@pytest.fixture
def camera():
    """640 x 480 pixels, focal length 800 pixels."""
    return rs.Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))


@pytest.fixture
def free_scene():
    """A flying camera with an image without border, looking at given points."""

    def build(points, K=((1, 0, 0), (0, 1, 0), (0, 0, 1)), **camera):
        body = rs.joints.Link("body", "base", rs.joints.Joint("floating"))
        robot = rs.Robot("free", [rs.joints.Link("base"), body])
        eye = rs.MountedCamera("eye", rs.Camera(K, **camera), on="free.body")
        return rs.Scene([robot], [rs.Object("dots", marks=points)], [eye])

    return build


@pytest.fixture
def puma_goal():
    """A configuration with the camera of `puma_scene` 0.5 m from its square and facing it."""
    return np.array([0, np.pi / 4, np.pi, 0, np.pi / 4, 0])


@pytest.fixture
def puma_scene(camera, puma_goal):
    """A Puma 560 with a camera on its flange and a square of four marks."""
    arm = rs.Robot.from_dh(PUMA_ROWS, name="puma")
    square = rs.Pose(arm.fk(puma_goal)) @ rs.Pose.at(0, 0, 0.5)
    eye = rs.MountedCamera("eye", camera, on="puma.link6")
    return rs.Scene([arm], [rs.Object("square", marks=SQUARE, pose=square)], [eye])


@pytest.fixture
def puma_starts(puma_goal):
    """Thirteen starts around the goal; most converge, some lose the square."""
    return puma_goal + np.random.default_rng(1).uniform(-0.06, 0.06, (13, 6))
