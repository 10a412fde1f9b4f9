"""The instants of a log: one for each period of control, on the log's own clock."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import FileError
from robsim.run.log import NANO, Log, Stream, Times

LONGEST = 1_000_000  # largest number of periods, which take minutes
SILENCE = 600 * NANO  # longest gap between two joint states; a longer gap is a clock error
EARLY = 0.2  # share of a period by which an image may follow, or a command precede, its instant
LOCKED = 0.3  # mean resultant length of the phases above which a signal keeps step with instants

Interpolation = Callable[[Array, Array, Array], Array]  # of values (n, ...) at shares (n,)


@dataclass(frozen=True, eq=False)
class LogInstants:
    """The instants (T,) of a log, one for each period of control.

    `nominal` are multiples of the period, in nanoseconds. `times` are the instants on the clock of
    the log: the time of the joint state nearest to the nominal time, within half a period. If there
    is none (`measured` is false), it is the nominal time.
    """

    nominal: Times
    times: Times
    measured: NDArray[np.bool_]
    step: float  # period in nanoseconds

    @property
    def offsets(self) -> Array:
        """The seconds (T,) from the nominal times to the times on the clock of the log."""
        return np.asarray((self.times - self.nominal) / NANO)


def find_instants(log: Log, dt: float) -> LogInstants:
    """Return the instants of a log with periods of dt seconds.

    The first is the first joint state when every mark has been seen; the last is the last joint
    state. A clock that jitters shifts the nominal times by the mean phase of the joint states, so
    that each joint state has an instant of its own. Raise FileError for a log that is shorter than
    a period or too long, or has a long gap.
    """
    step, joints = dt * NANO, log.joints
    _check_gaps(joints)
    nominal = _list_periods(log, log.first, step)
    phase = _measure_phase(joints, nominal, joints.find_step(step), EARLY)
    if phase is not None and round(phase):
        nominal = _list_periods(log, log.first + round(phase), step)
    near = joints.nearest(nominal)
    measured = _is_near(joints.times[near] - nominal, step)
    return LogInstants(nominal, np.where(measured, joints.times[near], nominal), measured, step)


def interpolate_stream(
    stream: Stream, instants: LogInstants, between: Interpolation | None = None
) -> Array:
    """Return the values (T, ...) of a continuous signal at instants.

    The value is the nearest within half a period. Without one it is interpolated, linearly unless
    `between` is given, from the values before and after the instant.
    """
    times = instants.times
    near, before = stream.nearest(times), np.maximum(stream.index(times), 0)
    after = np.minimum(before + 1, len(stream.times) - 1)
    far = ~_is_near(stream.times[near] - times, instants.step)
    start, end = stream.times[before[far]], stream.times[after[far]]
    share = np.clip((times[far] - start) / np.maximum(end - start, 1), 0.0, 1.0)
    values: Array = stream.values[near].copy()
    values[far] = (between or _interpolate_linearly)(
        stream.values[before[far]], stream.values[after[far]], share
    )
    return values


def index_images(images: Stream, instants: LogInstants) -> NDArray[np.int64]:
    """Return the index (T,) of the image at each instant, -1 before the first image.

    An image that keeps step with the instants belongs to the instant after it, which uses it.
    """
    return _index_nearest(images, instants, EARLY)


def index_commands(commands: Stream, instants: LogInstants) -> NDArray[np.int64]:
    """Return the index (T,) of the command at each instant, -1 before the first command.

    A command that keeps step with the instants belongs to the instant before it, which caused it.
    """
    return _index_nearest(commands, instants, 1.0 - EARLY)


def _index_nearest(stream: Stream, instants: LogInstants, latest: float) -> NDArray[np.int64]:
    """Return the index (T,) of the value at each instant, of a signal that is not interpolated.

    If the values keep step with the instants, with a mean phase of at most the share `latest` of a
    period, it is the value nearest to this phase within half a period. Otherwise it is the last
    value before the instant (zero-order hold).
    """
    times, step = instants.times, stream.find_step(instants.step)
    phase = _measure_phase(stream, times, step, latest)
    if phase is None:
        return stream.index(times)
    expected = times + round(phase)
    near = stream.nearest(expected)
    is_near = _is_near(stream.times[near] - expected, step)
    return np.asarray(np.where(is_near, near, stream.index(np.maximum(expected, times))))


def _measure_phase(stream: Stream, times: Times, step: float, latest: float) -> float | None:
    """Return the mean phase of a signal: the nanoseconds from an instant to its value.

    It is in (latest - 1, latest] steps; a later value belongs to the next instant. It is None if
    the signal does not keep step with the instants: the mean resultant length of the phases, 1 for
    equal and 0 for uniform phases, is small (Mardia and Jupp 2000, section 2.3).
    """
    offsets = stream.times[stream.nearest(times)] - times
    angles = offsets[_is_near(offsets, step)] * (math.tau / step)
    if not angles.size:
        return None
    mean = complex(np.cos(angles).mean(), np.sin(angles).mean())
    if abs(mean) < LOCKED:
        return None
    share = math.atan2(mean.imag, mean.real) / math.tau
    return (share - math.ceil(share - latest)) * step


def _is_near(offsets: NDArray[np.int64], step: float) -> NDArray[np.bool_]:
    """Return the offsets (ns) within half a step, so that each value is near one instant only."""
    return np.asarray((offsets > -0.5 * step) & (offsets <= 0.5 * step))


def _list_periods(log: Log, begin: int, step: float) -> Times:
    """Return the multiples of a period from a time to the last joint state, in nanoseconds.

    The last joint state may be half a period, or half of its own step, before the last multiple.
    """
    length = int(log.joints.times[-1]) - begin
    count = math.floor((length + 0.5 * log.joints.find_step(step)) / step)
    if count < 1:
        raise FileError(
            f"{log.source}: joints and all marks are known for {max(length / NANO, 0.0):g} s, "
            f"which is less than a period of {step / NANO:g} s"
        )
    if count > LONGEST:
        raise FileError(
            f"{log.source}: {count} periods of {step / NANO:g} s; at most {LONGEST} are read"
        )
    return np.asarray(begin + np.round(np.arange(count + 1) * step).astype(np.int64))


def _check_gaps(joints: Stream) -> None:
    """Raise FileError for a long gap between two joint states."""
    silent = np.flatnonzero(np.diff(joints.times) > SILENCE)
    if silent.size:
        before, after = joints.times[silent[0] : silent[0] + 2] / NANO
        raise FileError(f"{joints.what}: nothing between {before:.9g} s and {after:.9g} s")


def _interpolate_linearly(a: Array, b: Array, share: Array) -> Array:
    """Return a + share (b - a) for values (n, width) at shares (n,)."""
    values: Array = a + share[:, None] * (b - a)
    return values
