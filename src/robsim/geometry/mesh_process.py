"""The process that reads mesh files, with limits of processor time and memory.

One process reads all meshes, so that its start is paid once. It ends some seconds after its last
mesh, with this process, or if it exceeds a limit; then the next mesh starts another one.
"""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import sys
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from threading import Lock, Timer
from typing import Any, BinaryIO

from robsim.base.errors import FileError
from robsim.base.free_memory import get_address_space
from robsim.container import pack_container, unpack_container
from robsim.geometry.mesh_parser import ColoredMesh, parse_mesh_file

SECONDS = 10.0  # limit of processor time, plus SECONDS_PER_MB
SECONDS_PER_MB = 1.0
START = 20.0  # limit of the elapsed time in seconds, plus PATIENCE times that of processor time
PATIENCE = 6.0
MEMORY = 1 << 30  # limit of memory in bytes, plus BYTES_PER_BYTE for each byte of the file
BYTES_PER_BYTE = 24
IDLE = 20.0  # seconds without a mesh, after which the process ends
_COUNT = 8  # bytes of the length of a reply
_CODE = (
    "import sys; sys.path[:] = sys.argv[1:]; "
    "from robsim.geometry.mesh_process import serve_meshes; serve_meshes()"
)


class MeshProcess:
    """A process that reads mesh files, started at the first of them."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._owner = 0  # the process that has started it

    def read(self, path: Path, size: int) -> tuple[ColoredMesh, ...]:
        """Return the coloured parts of a mesh file; raise FileError if it cannot be read."""
        seconds = SECONDS + SECONDS_PER_MB * size / 1e6
        memory = MEMORY + BYTES_PER_BYTE * size
        request = json.dumps([os.path.abspath(path), seconds, memory]).encode() + b"\n"
        with self._lock:
            reply = self._ask(request, seconds) or self._ask(request, seconds)
        if reply is None:
            raise FileError("not readable: the process to read it ends at once")
        return _unpack_reply(reply)

    def _ask(self, request: bytes, seconds: float) -> bytes | None:
        """Return the reply to a request, None if the process has ended before it.

        Raise FileError if the process ends because of the request.
        """
        process = self._start()
        timer = Timer(START + PATIENCE * seconds, process.kill)
        timer.start()
        try:
            reply = _exchange(process, request)
        except BaseException:
            self.close()  # a stop by the user: its reply would answer the next request
            raise
        finally:
            timer.cancel()
        if reply is not None:
            return reply
        status = process.wait()
        self.close()
        if status == 0:  # it was idle
            return None
        if status in (-9, -24):  # SIGKILL by the timer, SIGXCPU by the limit
            raise FileError(f"not readable: it needs more than {seconds:.0f} s")
        raise FileError(f"not readable: its reader ends with status {status}")

    def _start(self) -> subprocess.Popen[bytes]:
        """Return the running process, or start it; a fork of this process starts its own."""
        process = self._process
        if process is not None and self._owner == os.getpid() and process.poll() is None:
            return process
        self.close()
        try:
            self._process = _start_process()
        except (OSError, TypeError) as error:  # TypeError: an embedded interpreter has no program
            raise FileError(f"not readable: no process to read it: {error}") from None
        self._owner = os.getpid()
        return self._process

    def close(self) -> None:
        """End the process, if it runs and belongs to this process."""
        process, self._process = self._process, None
        if process is None or self._owner != os.getpid():
            return
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            with suppress(OSError):
                pipe.close()  # type: ignore[union-attr]


MESH_PROCESS = MeshProcess()
atexit.register(MESH_PROCESS.close)


def _start_process() -> subprocess.Popen[bytes]:
    """Start a process that serves meshes."""
    threads = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # each takes memory
    return subprocess.Popen(
        [sys.executable, "-c", _CODE, *filter(None, sys.path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, **threads},
        start_new_session=True,  # Ctrl-C is for this process
    )


def _exchange(process: subprocess.Popen[bytes], request: bytes) -> bytes | None:
    """Send a request and return its reply; None if the process ends first."""
    assert process.stdin and process.stdout
    try:
        process.stdin.write(request)
        process.stdin.flush()
    except OSError:
        return None
    size = int.from_bytes(process.stdout.read(_COUNT), "little")
    reply = process.stdout.read(size)
    return reply if size and len(reply) == size else None


def _unpack_reply(reply: bytes) -> tuple[ColoredMesh, ...]:
    """Return the coloured parts in a reply; raise FileError if the reply is an error."""
    header, arrays = unpack_container(BytesIO(reply))
    if "error" in header:
        raise FileError(header["error"])
    thirds = zip(arrays[::3], arrays[1::3], arrays[2::3], header["colors"], strict=True)
    return tuple(ColoredMesh(*each) for each in thirds)


def serve_meshes() -> None:
    """Read the mesh files that are requested on stdin, and write each reply to stdout."""
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # libraries may print
    idle = _start_timer()
    for line in sys.stdin.buffer:
        idle.cancel()
        path, seconds, memory = json.loads(line)
        _import_libraries()
        _limit_resources(seconds, memory)
        _write_reply(replies, _make_reply(Path(path)))
        idle = _start_timer()
    os._exit(0)


def _start_timer() -> Timer:
    timer = Timer(IDLE, os._exit, [0])
    timer.daemon = True
    timer.start()
    return timer


def _import_libraries() -> None:
    """Import the libraries before the limits of a file count."""
    with suppress(ImportError):
        import fast_simplification  # noqa: F401
        import trimesh  # noqa: F401


def _limit_resources(seconds: float, memory: int) -> None:
    """Limit the further processor time and the further memory of this process."""
    with suppress(ImportError, OSError, ValueError):  # on systems without such limits
        import resource

        used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
        _set_limit(resource, resource.RLIMIT_CPU, used + seconds)
        _set_limit(resource, resource.RLIMIT_AS, get_address_space() + memory)


def _set_limit(resource: Any, kind: int, value: float) -> None:
    """Set a limit that can be raised again, at most to the limit of the user."""
    _, hard = resource.getrlimit(kind)
    soft = int(value + 1)
    resource.setrlimit(kind, (soft if hard < 0 else min(soft, hard), hard))


def _make_reply(path: Path) -> BytesIO:
    """Return a container with the coloured parts of a file, or with an error message."""
    try:
        meshes = parse_mesh_file(path)
    except FileError as error:
        return pack_container({"error": str(error)}, [])
    arrays: list[Any] = [array for mesh in meshes for array in mesh[:3]]
    return pack_container({"colors": [mesh.color for mesh in meshes]}, arrays)


def _write_reply(replies: BinaryIO, reply: BytesIO) -> None:
    content = reply.getbuffer()
    replies.write(len(content).to_bytes(_COUNT, "little"))
    replies.write(content)
    replies.flush()
