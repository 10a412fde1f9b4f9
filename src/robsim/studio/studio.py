"""The studio: a session and the server of its pages."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from robsim.robot.robot import Robot
from robsim.run.experiment import Experiment
from robsim.studies.study_result import StudyResult
from robsim.studio.pendant.pendant_session import PendantSession
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.session import Session
from robsim.studio.web.server import Server
from robsim.studio.workbench import Workbench


@contextmanager
def studio(
    shown: Experiment | StudyResult | Robot,
    shelf: ScenarioShelf | None = None,
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    allow_remote: bool = False,
) -> Iterator[Server]:
    """Serve pages that show and change an experiment, for the duration of a `with` block.

    The pages of a study show its map, and open its runs on request. The pages of a robot are a
    teach pendant.

    Parameters
    ----------
    shown : Experiment, StudyResult or Robot
        Experiment, study or robot to show.
    shelf : ScenarioShelf, optional
        Experiments to choose from. Default: the shipped experiments.
    host : str, default "127.0.0.1"
        Address of the server.
    port : int, default 0
        Port of the server; 0 is any free port.
    allow_remote : bool, default False
        Whether other machines may reach `host`.

    Yields
    ------
    Server
        The server; open `server.address` in a browser.

    Raises
    ------
    InputError
        If the experiment cannot run, the study has no map, or the address is not available.
    """
    shelf = shelf or ScenarioShelf.shipped()
    session: Session | PendantSession
    if isinstance(shown, Robot):
        session = PendantSession(shown)
    elif isinstance(shown, StudyResult):
        session = Session(None, shelf, shown)
    else:
        session = Session(Workbench(shown), shelf)
    with (
        Server(session, host, port, allow_remote) as server,
        _run_session(session, server.broadcast),
    ):
        yield server


@contextmanager
def _run_session(
    session: Session | PendantSession, broadcast: Callable[[str], None]
) -> Iterator[None]:
    """Run a session for the duration of a `with` block."""
    session.broadcast = broadcast
    session.start()
    try:
        yield
    finally:
        session.close()
