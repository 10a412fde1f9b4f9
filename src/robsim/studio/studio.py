"""A studio: a session behind a server, until it is stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from robsim.run.experiment import Experiment
from robsim.studio.bench import Bench
from robsim.studio.gallery import Shelf
from robsim.studio.session import Session
from robsim.studio.web.server import Server


@contextmanager
def studio(
    experiment: Experiment,
    shelf: Shelf | None = None,
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    allow_remote: bool = False,
) -> Iterator[Server]:
    """Serve pages that show and change an experiment, while the block lasts.

    shelf         experiments to choose from; None: those that RobSim ships
    host, port    where it listens; 0 is any free port
    allow_remote  whether `host` may be one that other machines reach

    InputError: the experiment cannot run, or it cannot listen there.
    """
    session = Session(Bench(experiment), shelf or Shelf.shipped())
    with Server(session, host, port, allow_remote) as server, _running(session, server.broadcast):
        yield server


@contextmanager
def _running(session: Session, broadcast: Callable[[str], None]) -> Iterator[None]:
    session.broadcast = broadcast
    session.start()
    try:
        yield
    finally:
        session.close()
