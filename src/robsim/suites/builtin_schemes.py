"""The built-in schemes of suites, and the conversion of user schemes to tasks."""

from __future__ import annotations

import sysconfig
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from robsim.base.errors import InputError, RobSimError, format_value, prefix_errors
from robsim.base.protocols import implements
from robsim.servo.constraints.user_constraint import ConstraintLike
from robsim.servo.laws.constrained_law import ConstrainedLaw
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
CONSTRAINED = "IBVS, L current", "IBVS, L mean", "PBVS, goal form"
LIBRARIES = [sysconfig.get_path(each) for each in ("stdlib", "purelib", "platlib")]
OWN_PATHS = (*LIBRARIES, str(Path(__file__).parents[1]))  # folders without user files
SCHEME_FORM = "a task such as rs.IBVS(), or a class or function scheme(goal, gain=2.0)"


def constrain_schemes(
    label: str, *constraints: ConstraintLike, names: Sequence[str] = CONSTRAINED
) -> dict[str, ServoTask]:
    """Return built-in schemes within constraints, with a label."""
    law = ConstrainedLaw(constraints)
    return {f"{name}, {label}": replace(BUILT_IN[name], law=law) for name in names}


def check_user_schemes(schemes: Any) -> dict[str, Any]:
    """Return user schemes by name; raise InputError for invalid ones."""
    if not isinstance(schemes, Mapping):
        raise InputError(
            f"expected schemes by name, as in {{'mine': IBVS}}, got {format_value(schemes)}"
        )
    for name, scheme in schemes.items():
        if not isinstance(name, str) or not name:
            raise InputError(f"expected a text as the name of a scheme, got {format_value(name)}")
        if not isinstance(scheme, ServoTask) and not callable(scheme):
            raise InputError(f"scheme '{name}': expected {SCHEME_FORM}; got {format_value(scheme)}")
        if name in BUILT_IN:
            raise InputError(f"scheme '{name}': a built-in scheme has this name")
    return dict(schemes)


def make_task(name: str, scheme: Any, goal: Any, gain: float) -> Task:
    """Return the task of a scheme for a goal and a gain; InputError names the scheme."""
    with convert_user_errors(f"scheme '{name}'"):
        if isinstance(scheme, ServoTask):
            return cast(Task, replace(cast(Any, scheme), goal=goal, gain=gain))
        result = scheme(goal, gain=gain)
    if not implements(result, Task):
        raise InputError(
            f"scheme '{name}': expected a task as its result, got {format_value(result)}"
        )
    return cast(Task, result)


@contextmanager
def convert_user_errors(subject: str) -> Iterator[None]:
    """Convert errors of user code into InputError, with the name of the code and the line."""
    try:
        with prefix_errors(subject):
            yield
    except (RobSimError, Warning):
        raise
    except Exception as error:
        raise InputError(f"{subject} {format_user_error(error)}") from error


def format_user_error(error: BaseException) -> str:
    """Return a phrase on an error of user code, with its line in the user's file if it has one."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if not frame.filename.startswith(OWN_PATHS)]
    where = f" ({own[-1].filename}, line {own[-1].lineno})" if own else ""
    return f"raised {type(error).__name__}: {error}{where}"
