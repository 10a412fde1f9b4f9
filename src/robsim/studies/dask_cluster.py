"""Simulation of a study on an existing dask.distributed cluster."""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import lru_cache
from typing import Any, Protocol

from robsim.base import interrupt
from robsim.base.errors import InputError, RobSimError, format_value
from robsim.studies.plan_execution import Chunk, Progress, StudySink, count_done, generate_chunks
from robsim.studies.row_simulator import ChunkResult, RowSimulator
from robsim.studies.study_plan import Plan
from robsim.studies.study_store import VERSIONS

PATIENCE = 10.0  # time limit for the answer of a scheduler, in seconds
POLL_INTERVAL = 0.02  # time between checks for a stop, in seconds
CHUNKS_AHEAD = 2  # pending chunks for each thread of the cluster


class ClusterClient(Protocol):
    """The methods of `dask.distributed.Client` that a study uses."""

    def ncores(self) -> Mapping[str, int]:
        """Return the number of threads of each worker."""
        ...

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Any:
        """Submit a call to the cluster, and return its future."""
        ...

    def cancel(self, futures: Any, /) -> Any:
        """Cancel the calls of some futures."""
        ...


def connect_client(address: str) -> Any:
    """Connect to the scheduler at an address; raise InputError if it does not answer in time.

    Encryption and keys come from the configuration of Dask.
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
    except Exception as error:  # noqa: BLE001 any server may answer
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"no scheduler answers at {address}: {reason:.200}") from None


async def _check_identity(distributed: Any, address: str) -> None:
    """Request the identity of a scheduler, without a client: a client would wait without end."""
    arguments = distributed.Security().get_connection_args("client")
    options = {"connection_args": arguments, "timeout": PATIENCE / 2}
    async with distributed.rpc(address, **options) as scheduler:
        await scheduler.identity()


def simulate_on_cluster(
    plan: Plan, sink: StudySink, size: int, client: ClusterClient, progress: Progress | None
) -> bool:
    """Simulate the missing runs on a cluster; return False after a stop.

    A chunk runs again if its worker dies. Raises InputError if a worker has another version.
    """
    at_once = CHUNKS_AHEAD * int(sum(client.ncores().values()))
    work, finished = pickle.dumps(plan), count_done(sink, plan)
    remaining, pending = generate_chunks(sink, plan, size), dict[Any, Chunk]()
    with interrupt.defer_stops() as stops:
        try:
            while not stops:
                _submit_chunks(client, work, remaining, pending, at_once)
                if not pending:
                    return True
                for future in _collect_finished(pending):
                    first, last = pending.pop(future)
                    sink.put(plan, first, last, _get_result(future))
                    finished += last - first
                    if progress:
                        progress(finished / plan.runs)
        finally:
            with suppress(Exception):  # the cluster may be lost
                client.cancel(list(pending))
    return False


def _submit_chunks(
    client: ClusterClient, work: bytes, remaining: Any, pending: dict[Any, Chunk], at_once: int
) -> None:
    """Submit chunks until `at_once` are pending."""
    for first, last in remaining:
        future = client.submit(simulate_chunk, work, VERSIONS, first, last, pure=False)
        pending[future] = first, last
        if len(pending) >= at_once:
            return


def _collect_finished(pending: dict[Any, Chunk]) -> list[Any]:
    """Return the finished chunks, after a short wait if there are none."""
    finished = [future for future in pending if future.done()]
    if not finished:
        time.sleep(POLL_INTERVAL)
    return finished


def check_client(client: Any) -> None:
    """Raise InputError unless a value is a Dask client of a cluster with workers."""
    if not isinstance(client, _import_distributed().Client):
        raise InputError(
            f"client: expected a client of dask.distributed, got {format_value(client)}"
        )
    if not client.ncores():
        raise InputError("the cluster has no workers; start some")


def _get_result(future: Any) -> ChunkResult:
    """Return the result of a chunk; raise RobSimError if the cluster failed."""
    error = future.exception()
    if error is None:
        result: ChunkResult = future.result()
        return result
    if isinstance(error, RobSimError):
        raise error
    text = " ".join(str(error).split())
    raise RobSimError(
        f"the cluster could not simulate some runs: {type(error).__name__}: {text:.300}"
    )


def simulate_chunk(plan: bytes, versions: dict[str, str], first: int, last: int) -> ChunkResult:
    """Simulate some runs in a worker with one thread; raise InputError for another version."""
    if versions != VERSIONS:
        raise InputError(
            "this worker has RobSim {robsim} with kernels {kernels:.12}, ".format(**VERSIONS)
            + "the study {robsim} with {kernels:.12}: install the same".format(**versions)
        )
    return _load_simulator(plan).simulate(first, last)


@lru_cache(maxsize=4)
def _load_simulator(plan: bytes) -> RowSimulator:
    """Return the simulator of a pickled plan."""
    return RowSimulator(pickle.loads(plan), threads=1)  # written by the client of this study


def _import_distributed() -> Any:
    """Import dask.distributed; raise InputError if it is not installed."""
    try:
        import distributed
    except ImportError:
        raise InputError(
            "a cluster needs dask.distributed: pip install 'robsim[cluster]'"
        ) from None
    return distributed
