"""The schemes that are compared: those of the textbooks, and how a user's becomes a task."""

from __future__ import annotations

import sysconfig
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from robsim.base.errors import InputError, RobSimError, naming, said
from robsim.servo.tasks.schemes import IBVS, PBVS, Hybrid, Partitioned
from robsim.servo.tasks.task import ServoTask, Task

BUILT_IN: Mapping[str, Any] = {
    "IBVS, L current": IBVS(),
    "IBVS, L desired": IBVS(interaction="desired"),
    "IBVS, L mean": IBVS(interaction="mean"),
    "PBVS, goal form": PBVS(),
    "PBVS, camera form": PBVS(form="camera"),
    "2 1/2 D": Hybrid(),
    "partitioned": Partitioned(),
}
LIBRARIES = [sysconfig.get_path(each) for each in ("stdlib", "purelib", "platlib")]
OURS = (*LIBRARIES, str(Path(__file__).parents[1]))  # where no user's files are
WANTED = "a task such as rs.IBVS(), or a class or function that is called as scheme(goal, gain=2.0)"


def checked(schemes: Any) -> dict[str, Any]:
    """Return a user's schemes by name; InputError for what is none."""
    if not isinstance(schemes, Mapping):
        raise InputError(f"expected schemes by name, as in {{'mine': IBVS}}, got {said(schemes)}")
    for name, scheme in schemes.items():
        if not isinstance(name, str) or not name:
            raise InputError(f"a scheme is called by a text, got {said(name)}")
        if not isinstance(scheme, ServoTask) and not callable(scheme):
            raise InputError(f"scheme '{name}': expected {WANTED}; got {said(scheme)}")
        if name in BUILT_IN:
            raise InputError(f"scheme '{name}': there is a built-in one of this name")
    return dict(schemes)


def task_of(name: str, scheme: Any, goal: Any, gain: float) -> Any:
    """Return the task that a scheme makes of a goal and a gain; InputError names the scheme."""
    with of_the_user(f"scheme '{name}'"):
        if isinstance(scheme, ServoTask):
            return replace(cast(Any, scheme), goal=goal, gain=gain)
        made = scheme(goal, gain=gain)
    if isinstance(made, type) or not isinstance(made, Task):
        raise InputError(f"scheme '{name}': expected that it returns a task, got {said(made)}")
    return made


@contextmanager
def of_the_user(what: str) -> Iterator[None]:
    """Turn what a user's code raises into an InputError that says of what, and at which line."""
    try:
        with naming(what):
            yield
    except (RobSimError, Warning):
        raise
    except Exception as error:
        raise InputError(f"{what} {told(error)}") from error


def told(error: BaseException) -> str:
    """Return what a user's code raised, and at which of its lines, where it is one of them."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if not frame.filename.startswith(OURS)]
    where = f" ({own[-1].filename}, line {own[-1].lineno})" if own else ""
    return f"raised {type(error).__name__}: {error}{where}"
