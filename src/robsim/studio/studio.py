"""A studio: a session behind a server, until it is stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from robsim.run.experiment import Experiment
from robsim.studies.study_result import StudyResult
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.session import Session
from robsim.studio.web.server import Server
from robsim.studio.workbench import Workbench


@contextmanager
def studio(
    shown: Experiment | StudyResult,
    shelf: ScenarioShelf | None = None,
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    allow_remote: bool = False,
) -> Iterator[Server]:
    """Serve pages that show and change an experiment, while the block lasts.

    Of a study they show the map, and open those of its runs that are asked for.

    shelf         experiments to choose from; None: those that RobSim ships
    host, port    where it listens; 0 is any free port
    allow_remote  whether `host` may be one that other machines reach

    InputError: the experiment cannot run, the study has no map, or it cannot listen there.
    """
    shelf = shelf or ScenarioShelf.shipped()
    if isinstance(shown, StudyResult):
        session = Session(None, shelf, shown)
    else:
        session = Session(Workbench(shown), shelf)
    with (
        Server(session, host, port, allow_remote) as server,
        _run_session(session, server.broadcast),
    ):
        yield server


@contextmanager
def _run_session(session: Session, broadcast: Callable[[str], None]) -> Iterator[None]:
    session.broadcast = broadcast
    session.start()
    try:
        yield
    finally:
        session.close()
