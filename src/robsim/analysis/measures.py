"""Measures of visual servoing: what a recorded run was like, as one number for each run.

They are in the spirit of Gans, Hutchinson and Corke 2003, "Performance tests for visual servo
control systems, with application to partitioned approaches to visual servo control": how long it
took, how far the marks strayed in the image, and how far the camera strayed in space. Each takes a
run of `simulate`, a batch or not, and its scene, and gives (B,), NaN where it is undefined. What
happens on the way is that of the recorded instants, so that only record="all" misses nothing.

"The camera" is whatever moves: where the camera stands still and the target is carried, ways and
rotations are those of the target, as in `path_length` of a run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.arrays import Array, length, runs_first, runs_last
from robsim.geometry.pose import homogeneous
from robsim.run.outcome import Outcome
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

SPOT = 1e-3  # of the distance to the target: a way that is shorter than this is a turn on the spot


def time_to_converge(run: xr.Dataset, scene: Scene) -> Array:
    """Seconds until every error was below its tolerance; NaN if it never was, or with hold."""
    if run.attrs.get("hold"):
        return np.full(_runs(run), np.nan)
    arrived = _batch(run, "outcome") == Outcome.CONVERGED
    return np.where(arrived, _batch(run, "end_time"), np.nan)


def pixel_error(run: xr.Dataset, scene: Scene) -> Array:
    """Pixels: the largest distance of a mark from its goal at the end."""
    return np.array(_batch(run, "pixel_error"))


def image_excursion(run: xr.Dataset, scene: Scene) -> Array:
    """The largest distance of a mark from its goal on the way, over the largest at the start."""
    away = _largest(pixels_away(run))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(away[:, 0] > 0, _worst(away) / away[:, 0], np.nan)


def image_detour(run: xr.Dataset, scene: Scene) -> Array:
    """Pixels: the largest distance of a mark from the straight line from its start to its goal."""
    way, goal = _batch(run, "pixels"), run["pixels_goal"].values
    start = way[:, :1]
    chord = goal - start
    square = _dot(chord, chord)
    along = _dot(way - start, chord) / np.where(square > 0, square, 1.0)
    off = way - start - np.clip(along, 0.0, 1.0)[..., None] * chord
    return _worst(_largest(_length(off)))


def path_length(run: xr.Dataset, scene: Scene) -> Array:
    """Metres that the camera went."""
    return np.array(_batch(run, "path_length"))


def path_ratio(run: xr.Dataset, scene: Scene) -> Array:
    """Path length over the straight distance from start to end; NaN for a turn on the spot."""
    moves = moving_frame(run, scene)
    ends = np.stack([_batch(run, "q0"), _batch(run, "q_end")], axis=1)
    place = _poses(scene, moves, ends)[..., :3, 3]
    straight = _length(place[:, 1] - place[:, 0])
    far = straight > SPOT * np.nan_to_num(target_distance(run, scene)[:, 0])
    return np.where(far, path_length(run, scene) / np.where(far, straight, 1.0), np.nan)


def retreat(run: xr.Dataset, scene: Scene, goal: float = np.nan) -> Array:
    """Metres by which camera and target were at most farther apart than at the start and the goal.

    The distance is that of the camera from the middle of the marks. `goal` is what it is at the
    goal; unknown (NaN), it is that at the end of a run that converged.
    """
    away = target_distance(run, scene)
    arrived = _batch(run, "outcome") == Outcome.CONVERGED
    end = np.where(arrived, target_distance(run, scene, "q_end")[:, 0], np.nan)
    known = np.fmax(away[:, 0], goal if np.isfinite(goal) else end)
    return np.maximum(_worst(away) - known, 0.0)


def rotation(run: xr.Dataset, scene: Scene) -> Array:
    """Radians through which the camera turned, forth and back."""
    R = _poses(scene, moving_frame(run, scene), _batch(run, "q"))[..., :3, :3]
    change = (R[:, 1:] - R[:, :-1]).reshape(*R[:, 1:].shape[:2], 9)
    half = np.sqrt(_dot(change, change) / 8.0)  # |R1 - R2| = sqrt(8) sin(angle/2)
    return _total(2.0 * np.arcsin(np.minimum(half, 1.0)))


def peak_speed(run: xr.Dataset, scene: Scene) -> Array:
    """The largest |v| of the camera, metres per second."""
    return _worst(_length(_twists(run, scene)[..., :3]))


def peak_turn_rate(run: xr.Dataset, scene: Scene) -> Array:
    """The largest |omega| of the camera, radians per second."""
    return _worst(_length(_twists(run, scene)[..., 3:]))


def effort_linear(run: xr.Dataset, scene: Scene) -> Array:
    """Integral of the squared velocities in m/s that are commanded, m^2/s; NaN without any."""
    return _integral(run, scene, "m/s", _batch(run, "qd") ** 2)


def effort_angular(run: xr.Dataset, scene: Scene) -> Array:
    """Integral of the squared velocities in rad/s that are commanded, rad^2/s."""
    return _integral(run, scene, "rad/s", _batch(run, "qd") ** 2)


def travel_linear(run: xr.Dataset, scene: Scene) -> Array:
    """Metres that joints went, forth and back; of a flying camera, along its three axes."""
    return _integral(run, scene, "m/s", _speeds(run))


def travel_angular(run: xr.Dataset, scene: Scene) -> Array:
    """Radians that joints turned, forth and back; of a flying camera, about its three axes."""
    return _integral(run, scene, "rad/s", _speeds(run))


def border_margin(run: xr.Dataset, scene: Scene) -> Array:
    """Pixels: the smallest distance of a mark from the border of its image, negative outside."""
    way, names = _batch(run, "pixels"), run["mark_camera"].values.tolist()
    borders = np.array([scene.camera(name).camera.border for name in names])
    borders = borders.reshape(-1, 2, 2)  # (N, axis, 2)
    inside = np.minimum(way - borders[..., 0], borders[..., 1] - way)
    least = -_worst(_largest(-inside.reshape(*way.shape[:2], -1)))
    return np.where(np.isfinite(least), least, np.nan)


def limit_margin(run: xr.Dataset, scene: Scene) -> Array:
    """The smallest distance of a joint from its limits, as a share of its range; NaN without."""
    low, high = scene.limits.T
    limited = np.isfinite(low) & np.isfinite(high)
    if not limited.any():
        return np.full(_runs(run), np.nan)
    q, low, high = _batch(run, "q")[..., limited], low[limited], high[limited]
    return -_worst(_largest(-np.minimum(q - low, high - q) / (high - low)))


@dataclass(frozen=True)
class Measure:
    """A measure, its unit, and how it is called."""

    of: Callable[..., Array]
    unit: str
    label: str
    short: str = ""  # in a table; what has none is in the data only

    @property
    def meaning(self) -> str:
        """The first sentence of its function."""
        return str(self.of.__doc__).split("\n", maxsplit=1)[0]


MEASURES = {
    "time": Measure(time_to_converge, "s", "time to converge", "time"),
    "pixel_error": Measure(pixel_error, "px", "error at the end", "error"),
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


def first_pair(run: xr.Dataset) -> tuple[str, str]:
    """Names of the first camera and of the target that it sees."""
    return str(run["mark_camera"].values[0]), str(run["mark_target"].values[0])


def moving_frame(run: xr.Dataset, scene: Scene) -> str:
    """The camera; or the target, where the camera stands still; without any, what is moved."""
    if "frame_pose" in run:
        return str(run["frame_pose"].attrs["frame"])
    camera, target = first_pair(run)
    carried = scene.tree.carries(camera) - scene.tree.carries(target)
    return camera if (carried > 0).any() else target


def moving_path(run: xr.Dataset, scene: Scene) -> Array:
    """(B, moments, 3) where the moving frame was, in the world; NaN after the end of a run."""
    way: Array = _poses(scene, moving_frame(run, scene), _batch(run, "q"))[..., :3, 3]
    return way


def target_distance(run: xr.Dataset, scene: Scene, moments: str = "q") -> Array:
    """(B, moments) metres from the camera to the middle of the marks, at q, "q0" or "q_end".

    NaN without a camera.
    """
    q = _batch(run, moments).reshape(_runs(run), -1, scene.nq)
    if not run.sizes["mark"]:
        return np.full(q.shape[:2], np.nan)
    return distance(scene, *first_pair(run), q)


def distance(scene: Scene, camera: str, target: str, q: Array) -> Array:
    """(B, moments) metres from a camera to the middle of an object's marks; q (B, moments, nq)."""
    eye, T = _poses(scene, camera, q)[..., :3, 3], _poses(scene, target, q)
    middle = T[..., :3, 3] - eye
    for j, place in enumerate(scene.object(target).marks.mean(axis=0)):
        middle = middle + place * T[..., :3, j]
    return _length(middle)


def pixels_away(run: xr.Dataset) -> Array:
    """(B, moments, marks) distances of the marks from their goals, in pixels."""
    off = _batch(run, "pixels") - run["pixels_goal"].values
    return _length(off)


def _batch(run: xr.Dataset, name: str) -> Any:
    """A variable with the run first; a single run is a batch of one."""
    variable = run[name]
    return variable.values if "run" in variable.dims else variable.values[None]


def _runs(run: xr.Dataset) -> int:
    return int(run.sizes.get("run", 1))


def _poses(scene: Scene, frame: str, q: Array) -> Array:
    """(B, moments, 4, 4) of a frame in the world; NaN where q (B, moments, nq) is."""
    T = scene.tree.frame(scene.tree.bodies(runs_last(q, 1)), frame)
    poses = homogeneous(T, q.shape[:-1])
    poses[np.isnan(q).any(axis=-1)] = np.nan
    return poses


def _twists(run: xr.Dataset, scene: Scene) -> Array:
    """(B, moments, 6) of the moving frame, in world axes."""
    q, qd = _batch(run, "q"), _velocities(run)
    J = scene.tree.jacobian(scene.tree.bodies(runs_last(q, 1)), moving_frame(run, scene))
    J = runs_first(J, q.shape[:2])
    twist = np.zeros((*q.shape[:2], 6))
    for j in range(scene.nv):
        twist += J[..., j] * qd[..., j, None]
    return twist


def _velocities(run: xr.Dataset) -> Array:
    """(B, moments, nv) of the joints: as commanded, where they follow at once."""
    velocities: Array = _batch(run, "qd_actual" if "qd_actual" in run else "qd")
    return velocities


def _speeds(run: xr.Dataset) -> Array:
    """(B, moments, nv) of the joints until the next moment; of those that lag the mean of both."""
    speeds = np.abs(_velocities(run))
    if "qd_actual" in run:
        speeds[:, :-1] = 0.5 * (speeds[:, :-1] + speeds[:, 1:])
    return speeds


def _integral(run: xr.Dataset, scene: Scene, unit: str, values: Array) -> Array:
    """Of what there is for each velocity (B, moments, nv), over those commanded that have a unit.

    Each value is held until the next moment of its run, as commands are.
    """
    chosen = (np.array(scene.velocity_units) == unit) & ~scene.prescribed
    if not chosen.any():
        return np.full(_runs(run), np.nan)
    held = np.diff(run["time"].values)
    going = np.isfinite(_batch(run, "q")[:, 1:]).all(axis=-1)
    rates = values[:, :-1, chosen]
    total = np.zeros(rates.shape[:2])
    for j in range(rates.shape[2]):
        total += rates[..., j]
    return _total(np.where(going, total * held, 0.0))


# Sums go one by one, so that a run has the same bits alone and in any batch.


def _dot(a: Array, b: Array) -> Array:
    """Inner products along the last axis."""
    out = a[..., 0] * b[..., 0]
    for i in range(1, a.shape[-1]):
        out = out + a[..., i] * b[..., i]
    return np.asarray(out)


def _length(v: Array) -> Array:
    """Lengths along the last axis."""
    return length(np.moveaxis(v, -1, 0))


def _total(values: Array) -> Array:
    """(B,) sums of (B, moments), in which NaN counts nothing."""
    sums = np.cumsum(np.nan_to_num(values), axis=1)
    return sums[:, -1] if sums.shape[1] else np.zeros(len(values))


def _largest(values: Array) -> Array:
    """(B, moments) of (B, moments, n)."""
    return np.asarray(values.max(axis=-1, initial=-np.inf))


def _worst(values: Array) -> Array:
    """(B,) largest of (B, moments), in which NaN counts nothing; NaN if there is no more."""
    found = np.where(np.isnan(values), -np.inf, values).max(axis=1)
    return np.where(np.isfinite(values).any(axis=1), found, np.nan)
