"""Performance measures of visual servoing: one number for each recorded run.

The measures follow Gans, Hutchinson and Corke 2003, "Performance tests for visual servo control
systems, with application to partitioned approaches to visual servo control": duration, deviation of
the marks in the image, and deviation of the camera in space. Each function takes `RecordedRuns` and
returns one number for each run, (B,), NaN if the measure is undefined. Measures over a run use the
recorded instants, so that only record="all" covers every instant.

"The camera" means the moving frame. If the camera stands still and the target moves, paths and
rotations belong to the target, as in `path_length` of a run.

The first line of each docstring is the `long_name` of its variable, and hence a noun phrase.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr

from robsim.analysis.run_arrays import RecordedRuns
from robsim.base.arrays import Array, euclidean_length
from robsim.run.end_variables import compute_rotation_angle
from robsim.world.scene import Scene

SPOT_SHARE = 1e-3  # longest path of a turn on the spot, as a share of the distance to the target


def time_to_converge(data: RecordedRuns) -> Array:
    """The time in seconds until every error is below its tolerance; NaN if never, or with hold."""
    if data.run.attrs.get("hold"):
        return np.full(data.runs, np.nan)
    return np.where(data.converged, data.variable("end_time"), np.nan)


def pixel_error(data: RecordedRuns) -> Array:
    """The largest distance in pixels of a mark from its goal at the end."""
    return np.array(data.variable("pixel_error"))


def distance_to_goal(data: RecordedRuns) -> Array:
    """The distance in metres of the camera from its goal at the end; NaN if unknown."""
    return np.array(data.variable("distance_to_goal"))


def angle_to_goal(data: RecordedRuns) -> Array:
    """The angle in radians between the camera and its goal at the end; NaN if unknown."""
    return np.array(data.variable("angle_to_goal"))


def image_excursion(data: RecordedRuns) -> Array:
    """The largest distance of a mark from its goal in the run, over the largest at the start."""
    distances = _largest_value(_pixel_lengths(data.pixels - data.goal_at_instants))
    start, worst = data.first(distances), data.maximum_per_run(distances)
    return np.where(start > 0, worst / np.where(start > 0, start, 1.0), np.nan)


def image_detour(data: RecordedRuns) -> Array:
    """The largest distance in pixels of a mark from the straight line between start and goal."""
    start = np.moveaxis(data.variable("pixels")[:, 0], 0, -1)
    chord = data.pixels_goal - start
    square = _inner_products(chord, chord)
    chord, square = data.repeat(chord), data.repeat(np.where(square > 0, square, 1.0))
    offsets = data.pixels - data.repeat(start)
    offsets -= np.clip(_inner_products(offsets, chord) / square, 0.0, 1.0)[:, None] * chord
    return data.maximum_per_run(_largest_value(_pixel_lengths(offsets)))


def path_length(data: RecordedRuns) -> Array:
    """The length of the camera's path in metres."""
    return np.array(data.variable("path_length"))


def path_ratio(data: RecordedRuns) -> Array:
    """The path length over the straight distance from start to end; NaN for a turn on the spot."""
    start, end = (data.poses(data.mover, data.per_run(q))[:, 3] for q in ("q0", "q_end"))
    straight = euclidean_length(end - start)
    moves = straight > SPOT_SHARE * np.nan_to_num(data.first(data.camera_distances))
    return np.where(moves, path_length(data) / np.where(moves, straight, 1.0), np.nan)


def retreat(data: RecordedRuns) -> Array:
    """The distance in metres that the camera backed away beyond its start and its goal.

    The distance of the camera is measured from the middle of the marks. If the pose of the goal is
    unknown, the end of a converged run replaces it.
    """
    if not data.run.sizes["mark"]:
        return np.full(data.runs, np.nan)
    q = data.per_run("q_end")
    end = data.distance(data.poses(data.pair[0], q)[:, 3], q)
    goal = np.where(data.converged, end, np.nan)
    goal = np.where(np.isfinite(data.goal_distance), data.goal_distance, goal)
    return np.maximum(
        data.maximum_per_run(data.camera_distances)
        - np.fmax(data.first(data.camera_distances), goal),
        0.0,
    )


def rotation(data: RecordedRuns) -> Array:
    """The total angle in radians through which the camera turned, back and forth."""
    R = data.mover_poses[:, :3].reshape(9, -1)
    return data.sum_per_run(compute_rotation_angle(R[:, 1:] - R[:, :-1]))


def peak_speed(data: RecordedRuns) -> Array:
    """The largest linear speed |v| of the camera in metres per second."""
    return data.maximum_per_run(euclidean_length(data.twists[:3]))


def peak_turn_rate(data: RecordedRuns) -> Array:
    """The largest angular speed |omega| of the camera in radians per second."""
    return data.maximum_per_run(euclidean_length(data.twists[3:]))


def effort_linear(data: RecordedRuns) -> Array:
    """The integral of the squared commanded velocities in m/s, in m^2/s; NaN without any."""
    return _integrate_effort(data, "m/s")


def effort_angular(data: RecordedRuns) -> Array:
    """The integral of the squared commanded velocities in rad/s, in rad^2/s; NaN without any."""
    return _integrate_effort(data, "rad/s")


def travel_linear(data: RecordedRuns) -> Array:
    """The distance in metres that joints moved, back and forth; NaN without any such joint.

    A flying camera has three linear axes.
    """
    return _integrate_unit(data, "m/s", _joint_speeds(data))


def travel_angular(data: RecordedRuns) -> Array:
    """The angle in radians that joints turned, back and forth; NaN without any such joint.

    A flying camera has three rotation axes.
    """
    return _integrate_unit(data, "rad/s", _joint_speeds(data))


def border_margin(data: RecordedRuns) -> Array:
    """The smallest distance in pixels of a mark from its image border; negative outside."""
    names = data.run["mark_camera"].values.tolist()
    borders = np.array([data.scene.camera(name).camera.border for name in names])
    if not np.isfinite(borders).any():
        return np.full(data.runs, np.nan)
    low, high = borders[..., 0, None], borders[..., 1, None]  # (N, 2, 1)
    inside = np.minimum(data.pixels - low, high - data.pixels)
    least = -data.maximum_per_run(_largest_value(-np.concatenate(inside)))
    return np.where(np.isfinite(least), least, np.nan)


def limit_margin(data: RecordedRuns) -> Array:
    """The least distance of a joint from its limits, as a share of its range; NaN if unlimited."""
    low, high = data.scene.limits.T[..., None]
    has_limits = (np.isfinite(low) & np.isfinite(high))[:, 0]
    if not has_limits.any():
        return np.full(data.runs, np.nan)
    q, low, high = data.q[has_limits], low[has_limits], high[has_limits]
    return -data.maximum_per_run(_largest_value(-np.minimum(q - low, high - q) / (high - low)))


@dataclass(frozen=True)
class Measure:
    """A measure: its function, its unit and its labels."""

    of: Callable[[RecordedRuns], Array]
    unit: str
    label: str
    short: str = ""  # head of the column in tables; empty for measures that tables omit

    @property
    def meaning(self) -> str:
        """The first line of the function's docstring."""
        return str(self.of.__doc__).split("\n", maxsplit=1)[0]


MEASURES = {
    "time": Measure(time_to_converge, "s", "time to converge", "time"),
    "pixel_error": Measure(pixel_error, "px", "error at the end", "error"),
    "distance_to_goal": Measure(distance_to_goal, "m", "distance to the goal at the end"),
    "angle_to_goal": Measure(angle_to_goal, "rad", "angle to the goal at the end"),
    "image_excursion": Measure(image_excursion, "1", "image excursion", "excursion"),
    "image_detour": Measure(image_detour, "px", "image detour", "detour"),
    "path_length": Measure(path_length, "m", "camera path", "path"),
    "path_ratio": Measure(path_ratio, "1", "path / straight", "/straight"),
    "retreat": Measure(retreat, "m", "camera retreat", "retreat"),
    "rotation": Measure(rotation, "rad", "rotation travelled", "rotation"),
    "peak_speed": Measure(peak_speed, "m/s", "peak speed"),
    "peak_turn_rate": Measure(peak_turn_rate, "rad/s", "peak turn rate"),
    "effort_linear": Measure(effort_linear, "m^2/s", "linear effort", "effort"),
    "effort_angular": Measure(effort_angular, "rad^2/s", "angular effort", "effort"),
    "travel_linear": Measure(travel_linear, "m", "linear joint travel"),
    "travel_angular": Measure(travel_angular, "rad", "angular joint travel"),
    "border_margin": Measure(border_margin, "px", "margin to the border", "border"),
    "limit_margin": Measure(limit_margin, "1", "margin to joint limits", "limits"),
}


def collect_mover_positions(run: xr.Dataset, scene: Scene) -> Array:
    """Return positions (B, instants, 3) of the moving frame in the world; NaN after a run's end."""
    data = RecordedRuns(run, scene)
    positions = np.full((*data.live.shape, 3), np.nan)
    positions[data.live] = data.mover_poses[:, 3].T
    return positions


def compute_pixel_distances(run: xr.Dataset) -> Array:
    """Return distances (B, instants, marks) of the marks from their goals, in pixels."""
    offsets = np.moveaxis(run["pixels"].values - run["pixels_goal"].values, -1, 0)
    return (
        euclidean_length(offsets)
        if "run" in run["pixels"].dims
        else euclidean_length(offsets)[None]
    )


def _joint_speeds(data: RecordedRuns) -> Array:
    """Return joint speeds (nv, M - 1) between instants; the mean of both ends if joints lag."""
    speeds = np.abs(data.velocities)
    return 0.5 * (speeds[:, :-1] + speeds[:, 1:]) if "qd_actual" in data.run else speeds[:, :-1]


def _integrate_effort(data: RecordedRuns, unit: str) -> Array:
    """Return the integral of the squared commanded velocities; NaN for commands of torques."""
    if data.run["qd"].attrs.get("units", "").startswith("N"):
        return np.full(data.runs, np.nan)
    return _integrate_unit(data, unit, data.qd[:, :-1] ** 2)


def _integrate_unit(data: RecordedRuns, unit: str, values: Array) -> Array:
    """Return the integral of values (nv, M - 1) over the commanded velocities with a given unit.

    Each value is held until the next instant of its run, as commands are.
    """
    chosen = (np.array(data.scene.velocity_units) == unit) & ~data.scene.prescribed
    if not chosen.any():
        return np.full(data.runs, np.nan)
    total = np.zeros(values.shape[1])
    for j in np.flatnonzero(chosen):
        total += values[j]
    return data.sum_per_run(total * data.hold_times)


def _inner_products(a: Array, b: Array) -> Array:
    """Return inner products (N, M) of vectors (N, 2, M)."""
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1])


def _pixel_lengths(v: Array) -> Array:
    """Return lengths (N, M) of vectors (N, 2, M)."""
    return euclidean_length(np.moveaxis(v, 1, 0))


def _largest_value(values: Array) -> Array:
    """Return the maximum (M,) of values (n, M) over the first axis."""
    return np.asarray(values.max(axis=0, initial=-np.inf))
