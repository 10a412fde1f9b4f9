"""Performance measures of visual servoing: one number for each recorded run.

They are in the spirit of Gans, Hutchinson and Corke 2003, "Performance tests for visual servo
control systems, with application to partitioned approaches to visual servo control": how long it
took, how far the marks strayed in the image, and how far the camera strayed in space. Each takes
`RecordedRuns` runs and gives (B,), NaN where it is undefined. What happens on the way is that of the
recorded instants, so that only record="all" misses nothing.

"The camera" is the frame that moves: where the camera stands still and the target is carried, ways
and rotations are those of the target, as in `path_length` of a run.
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

SPOT_SHARE = 1e-3  # share of the distance to the target below which a path is a turn on the spot


def time_to_converge(of: RecordedRuns) -> Array:
    """The time in seconds until every error is below its tolerance; NaN if never, or with hold."""
    if of.run.attrs.get("hold"):
        return np.full(of.runs, np.nan)
    return np.where(of.converged, of.each("end_time"), np.nan)


def pixel_error(of: RecordedRuns) -> Array:
    """The largest distance in pixels of a mark from its goal at the end."""
    return np.array(of.each("pixel_error"))


def distance_to_goal(of: RecordedRuns) -> Array:
    """The distance in metres of the camera from its goal at the end; NaN where unknown."""
    return np.array(of.each("distance_to_goal"))


def angle_to_goal(of: RecordedRuns) -> Array:
    """The angle in radians between the camera and its goal at the end; NaN where unknown."""
    return np.array(of.each("angle_to_goal"))


def image_excursion(of: RecordedRuns) -> Array:
    """The largest distance of a mark from its goal on the way, over the largest at the start."""
    away = _largest_value(_pixel_lengths(of.pixels - of.goal_at_moments))
    start, worst = of.first(away), of.worst(away)
    return np.where(start > 0, worst / np.where(start > 0, start, 1.0), np.nan)


def image_detour(of: RecordedRuns) -> Array:
    """The largest distance in pixels of a mark from the straight line between start and goal."""
    start = np.moveaxis(of.each("pixels")[:, 0], 0, -1)
    chord = of.pixels_goal - start
    square = _inner_products(chord, chord)
    chord, square = of.spread(chord), of.spread(np.where(square > 0, square, 1.0))
    off = of.pixels - of.spread(start)
    off -= np.clip(_inner_products(off, chord) / square, 0.0, 1.0)[:, None] * chord
    return of.worst(_largest_value(_pixel_lengths(off)))


def path_length(of: RecordedRuns) -> Array:
    """The length of the camera's path in metres."""
    return np.array(of.each("path_length"))


def path_ratio(of: RecordedRuns) -> Array:
    """The path length over the straight distance from start to end; NaN for a turn on the spot."""
    start, end = (of.poses(of.mover, of.at_once(q))[:, 3] for q in ("q0", "q_end"))
    straight = euclidean_length(end - start)
    far = straight > SPOT_SHARE * np.nan_to_num(of.first(of.away))
    return np.where(far, path_length(of) / np.where(far, straight, 1.0), np.nan)


def retreat(of: RecordedRuns) -> Array:
    """The distance in metres by which the camera backed away beyond its start and its goal.

    The distance is that of the camera from the middle of the marks. Where the pose of the goal is
    not known, it is that at the end of a run that converged.
    """
    if not of.run.sizes["mark"]:
        return np.full(of.runs, np.nan)
    q = of.at_once("q_end")
    end = of.distance(of.poses(of.pair[0], q)[:, 3], q)
    goal = np.where(of.converged, end, np.nan)
    goal = np.where(np.isfinite(of.goal_distance), of.goal_distance, goal)
    return np.maximum(of.worst(of.away) - np.fmax(of.first(of.away), goal), 0.0)


def rotation(of: RecordedRuns) -> Array:
    """The total angle in radians through which the camera turned, back and forth."""
    R = of.way[:, :3].reshape(9, -1)
    return of.total(compute_rotation_angle(R[:, 1:] - R[:, :-1]))


def peak_speed(of: RecordedRuns) -> Array:
    """The largest linear speed |v| of the camera in metres per second."""
    return of.worst(euclidean_length(of.twists[:3]))


def peak_turn_rate(of: RecordedRuns) -> Array:
    """The largest angular speed |omega| of the camera in radians per second."""
    return of.worst(euclidean_length(of.twists[3:]))


def effort_linear(of: RecordedRuns) -> Array:
    """The integral of the squared commanded velocities in m/s, in m^2/s; NaN without any."""
    return _integrate_unit(of, "m/s", of.qd[:, :-1] ** 2)


def effort_angular(of: RecordedRuns) -> Array:
    """The integral of the squared commanded velocities in rad/s, in rad^2/s; NaN without any."""
    return _integrate_unit(of, "rad/s", of.qd[:, :-1] ** 2)


def travel_linear(of: RecordedRuns) -> Array:
    """The distance in metres that joints moved, back and forth; NaN without any such joint.

    A flying camera moves along its three axes.
    """
    return _integrate_unit(of, "m/s", _joint_speeds(of))


def travel_angular(of: RecordedRuns) -> Array:
    """The angle in radians that joints turned, back and forth; NaN without any such joint.

    A flying camera turns about its three axes.
    """
    return _integrate_unit(of, "rad/s", _joint_speeds(of))


def border_margin(of: RecordedRuns) -> Array:
    """The smallest distance in pixels of a mark from its image border; negative outside."""
    names = of.run["mark_camera"].values.tolist()
    borders = np.array([of.scene.camera(name).camera.border for name in names])
    if not np.isfinite(borders).any():
        return np.full(of.runs, np.nan)
    low, high = borders[..., 0, None], borders[..., 1, None]  # (N, 2, 1)
    inside = np.minimum(of.pixels - low, high - of.pixels)
    least = -of.worst(_largest_value(-np.concatenate(inside)))
    return np.where(np.isfinite(least), least, np.nan)


def limit_margin(of: RecordedRuns) -> Array:
    """The least distance of a joint from its limits, as a share of its range; NaN if unlimited."""
    low, high = of.scene.limits.T[..., None]
    limited = (np.isfinite(low) & np.isfinite(high))[:, 0]
    if not limited.any():
        return np.full(of.runs, np.nan)
    q, low, high = of.q[limited], low[limited], high[limited]
    return -of.worst(_largest_value(-np.minimum(q - low, high - q) / (high - low)))


@dataclass(frozen=True)
class Measure:
    """A measure with its function, its unit and its labels."""

    of: Callable[[RecordedRuns], Array]
    unit: str
    label: str
    short: str = ""  # head of its column in a table; measures without one are left out

    @property
    def meaning(self) -> str:
        """The first line of the docstring of its function."""
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
    """Return positions (B, moments, 3) of the moving frame in the world; NaN after a run's end."""
    of = RecordedRuns(run, scene)
    way = np.full((*of.live.shape, 3), np.nan)
    way[of.live] = of.way[:, 3].T
    return way


def compute_pixel_distances(run: xr.Dataset) -> Array:
    """Return distances (B, moments, marks) of the marks from their goals, in pixels."""
    away = np.moveaxis(run["pixels"].values - run["pixels_goal"].values, -1, 0)
    return euclidean_length(away) if "run" in run["pixels"].dims else euclidean_length(away)[None]


def _joint_speeds(of: RecordedRuns) -> Array:
    """Return joint speeds (nv, M - 1) until the next moment; the mean of both ends if they lag."""
    speeds = np.abs(of.velocities)
    return 0.5 * (speeds[:, :-1] + speeds[:, 1:]) if "qd_actual" in of.run else speeds[:, :-1]


def _integrate_unit(of: RecordedRuns, unit: str, values: Array) -> Array:
    """Return the integral of values (nv, M - 1), over the commanded velocities of a unit.

    Each value is held until the next moment of its run, as commands are.
    """
    chosen = (np.array(of.scene.velocity_units) == unit) & ~of.scene.prescribed
    if not chosen.any():
        return np.full(of.runs, np.nan)
    total = np.zeros(values.shape[1])
    for j in np.flatnonzero(chosen):
        total += values[j]
    return of.total(total * of.held)


def _inner_products(a: Array, b: Array) -> Array:
    """Return inner products (N, M) of vectors (N, 2, M)."""
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1])


def _pixel_lengths(v: Array) -> Array:
    """Return lengths (N, M) of vectors (N, 2, M)."""
    return euclidean_length(np.moveaxis(v, 1, 0))


def _largest_value(values: Array) -> Array:
    """Return the largest (M,) of values (n, M)."""
    return np.asarray(values.max(axis=0, initial=-np.inf))
