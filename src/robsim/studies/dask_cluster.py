"""The runs of a study on a cluster of dask.distributed that somebody else has started."""

from __future__ import annotations

import pickle
import time
from contextlib import suppress
from functools import lru_cache
from typing import Any

from robsim.base import interrupt
from robsim.base.errors import InputError, RobSimError, format_value
from robsim.studies.plan_execution import Chunk, Progress, StudySink, count_done, generate_chunks
from robsim.studies.row_simulator import ChunkResult, RowSimulator
from robsim.studies.study_plan import Plan
from robsim.studies.study_store import VERSIONS

PATIENCE = 10.0  # seconds, for a scheduler to answer
POLL_INTERVAL = 0.02  # seconds between looks for a stop
CHUNKS_AHEAD = 2  # chunks for each thread of the cluster that are given out at a time


def connect_client(address: str) -> Any:
    """Return a client of the scheduler at an address; InputError if it does not answer in time.

    Encryption and keys are those of Dask's own configuration.
    """
    import asyncio

    distributed = _import_distributed()
    if not isinstance(address, str) or "://" not in address:
        raise InputError(
            f"scheduler: expected an address such as tcp://host:8786, got {format_value(address)}"
        )
    try:
        asyncio.run(asyncio.wait_for(_check_identity(distributed, address), PATIENCE))
        return distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except Exception as error:  # noqa: BLE001 what is there may be anything, and answer so
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"no scheduler answers at {address}: {reason:.200}") from None


async def _check_identity(distributed: Any, address: str) -> None:
    """Ask a scheduler who it is, without a client, which would wait for it to its own end."""
    arguments = distributed.Security().get_connection_args("client")
    async with distributed.rpc(address, connection_args=arguments, timeout=PATIENCE / 2) as there:
        await there.identity()


def simulate_on_cluster(
    plan: Plan, sink: StudySink, size: int, client: Any, progress: Progress | None
) -> bool:
    """Simulate what is missing on a cluster; return False if a stop came before the end.

    A chunk whose worker dies runs again on another. InputError: a worker of another version.
    """
    at_once = CHUNKS_AHEAD * int(sum(client.ncores().values()))
    work, finished = pickle.dumps(plan), count_done(sink, plan)
    left, going = generate_chunks(sink, plan, size), dict[Any, Chunk]()
    with interrupt.defer_stops() as stops:
        try:
            while not stops:
                _submit_chunks(client, work, left, going, at_once)
                if not going:
                    return True
                for future in _collect_finished(going):
                    first, last = going.pop(future)
                    sink.put(plan, first, last, _get_result(future))
                    finished += last - first
                    if progress:
                        progress(finished / plan.runs)
        finally:
            with suppress(Exception):  # it may be the cluster that has gone
                client.cancel(list(going))
    return False


def _submit_chunks(
    client: Any, work: bytes, left: Any, going: dict[Any, Chunk], at_once: int
) -> None:
    """Give out chunks until so many are on their way."""
    for first, last in left:
        going[client.submit(simulate_chunk, work, VERSIONS, first, last, pure=False)] = first, last
        if len(going) >= at_once:
            return


def _collect_finished(going: dict[Any, Chunk]) -> list[Any]:
    """Return the chunks that are done, after a short wait if there are none."""
    found = [future for future in going if future.done()]
    if not found:
        time.sleep(POLL_INTERVAL)
    return found


def check_client(client: Any) -> None:
    """Raise InputError unless a value is a client of Dask, whose cluster has workers."""
    if not isinstance(client, _import_distributed().Client):
        raise InputError(
            f"client: expected a client of dask.distributed, got {format_value(client)}"
        )
    if not client.ncores():
        raise InputError("the cluster has no workers; start some, and they will be used")


def _get_result(future: Any) -> ChunkResult:
    """Return what came out of a chunk; RobSimError if the cluster could not do it."""
    error = future.exception()
    if error is None:
        found: ChunkResult = future.result()
        return found
    if isinstance(error, RobSimError):
        raise error
    text = " ".join(str(error).split())
    raise RobSimError(
        f"the cluster could not simulate some runs: {type(error).__name__}: {text:.300}"
    )


def simulate_chunk(plan: bytes, versions: dict[str, str], first: int, last: int) -> ChunkResult:
    """Simulate some runs in a worker, in one thread; InputError if its version is another."""
    if versions != VERSIONS:
        raise InputError(
            "this worker has RobSim {robsim} with kernels {kernels:.12}, ".format(**VERSIONS)
            + "the study {robsim} with {kernels:.12}: install the same".format(**versions)
        )
    return _load_simulator(plan).done(first, last)


@lru_cache(maxsize=4)
def _load_simulator(plan: bytes) -> RowSimulator:
    return RowSimulator(
        pickle.loads(plan), threads=1
    )  # from our own client, as all tasks of Dask are


def _import_distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise InputError(
            "a cluster needs dask.distributed: pip install 'robsim[cluster]'"
        ) from None
    return distributed
