"""Checks for your own features, laws and joints; each returns a list of problems, empty if none.

>>> from robsim.features import Points
>>> from robsim.laws import JointLaw
>>> check_feature(Points()), check_law(JointLaw())
([], [])
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from robsim.base.arrays import Array, as_bool, as_floats, as_integer, make_read_only, move_runs_last
from robsim.base.errors import InputError, format_value
from robsim.features.feature import Feature, Observation
from robsim.geometry.pose import Pose, homogeneous_matrix
from robsim.robot.joints.joint_kind import JointKind, check_joint_kind
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.inverse import PseudoInverse, multiply_batches
from robsim.servo.laws.law import Law
from robsim.vision.camera import Camera

RUNS, MARKS = 5, 4
MOST = 10_000  # runs, marks, joints or features
CAMERA = Camera([[800, 0, 320], [0, 820, 240], [0, 0, 1]])
OTHER_CAMERA = Camera([[700, 3, 330], [0, 690, 250], [0, 0, 1]], distortion=(-0.1, 0.02, 0, 0))
BETWEEN = Pose.at(0.25, 0.02, -0.03, rpy=(0.02, -0.15, 0.05))  # the second camera in the first
ROUNDING = 1e-12  # of the largest number: what differs by less is the order of sums
MOTIONS = ("vx", "vy", "vz", "wx", "wy", "wz")  # of a camera
STEPS = (1e-2, 5e-3, 2.5e-3)  # of camera motion, metres and radians


def check_feature(
    feature: Feature, marks: Any = MARKS, seed: int = 0, runs: int = RUNS, *, bits: bool = False
) -> list[str]:
    """Check that a feature's interaction is the derivative of measure, run by run.

    L is compared with central differences of s along each of the six camera motions; their
    error must shrink with the square of the step, which a wrong sign or factor cannot do. A row
    alone may differ from the same row in a batch by rounding, 1e-12 of the largest number; with
    `bits` it must be the same to the last bit, as of RobSim's own features.
    `marks` are (N, 3) in axes of the target, or how many, scattered; `runs` views are random.
    """
    least = 0.0 if as_bool(bits, "bits") else ROUNDING
    if isinstance(feature, type) or not isinstance(feature, Feature):
        raise InputError(
            f"expected a feature, with measure, unit and tolerance, got {format_value(feature)}"
        )
    views = _RandomViews.random(marks, seed, runs)
    if hasattr(feature, "towards"):
        goal = _RandomViews.random(views.marks, seed + 1, 1, rotation=0.3)
        feature = feature.towards(goal.observed(feature))
    seen = views.observed(feature)
    problems = _check_attributes(feature)
    s, failures = _call_and_check(feature, "measure", seen, (runs, None))
    if failures:
        return [*problems, *failures]

    def alone(rows: Any) -> Observation:
        return views.some(rows).observed(feature)

    problems += _check_rows_alone(lambda rows: feature.measure(alone(rows)), s, "measure", least)
    if not hasattr(feature, "interaction"):
        return problems
    L, failures = _call_and_check(feature, "interaction", seen, (runs, s.shape[1], 6))
    if failures:
        return [*problems, *failures]
    columns = [f"{type(feature).__name__}.interaction, column {motion}" for motion in MOTIONS]
    scales = np.full(6, 1.0 + np.abs(L).max())
    problems += _check_against_differences(
        columns, partial(_subtract_interaction, feature, views), L, scales, "measure"
    )
    return problems + _check_rows_alone(
        lambda rows: feature.interaction(alone(rows)), L, "interaction", least
    )


def check_law(
    law: Law, joints: int = 6, features: int = 8, seed: int = 0, *, bits: bool = False
) -> list[str]:
    """Check that a law returns finite velocities that reduce the error, zero at the goal.

    The error decreases where e' L J qdot < 0 with an exact model; the goal is s = 0. A run alone
    may differ from the same run in a batch as with `check_feature`. Only with the same `bits` do
    the runs of a simulation not depend on how they are divided among threads.
    """
    joints, features = (
        as_integer(joints, "joints", 1, MOST),
        as_integer(features, "features", 1, MOST),
    )
    rng = np.random.default_rng(as_integer(seed, "seed", 0))
    e = rng.normal(size=(features, RUNS))
    L, J = rng.normal(size=(features, 6, RUNS)), rng.normal(size=(6, joints, RUNS))
    at = rng.normal(size=(joints, RUNS))

    def state(rows: Any, scale: float = 1.0) -> ControlState:
        error, M, N, q = (a[..., rows] for a in (scale * e, L, J, at))
        A = multiply_batches(*map(np.ascontiguousarray, (M, N)))
        return ControlState(error, M, N, A, 1.0, PseudoInverse(), s_last=error, q_last=q)

    name = type(law).__name__
    qd, failures = _call_and_check(law, "command", state(slice(None)), (RUNS, joints))
    if failures:
        return failures
    least = 0.0 if as_bool(bits, "bits") else ROUNDING
    problems = _check_rows_alone(
        lambda rows: law.command(state(rows)), qd, f"{name}.command", least
    )
    at_rest, failures = _call_and_check(law, "command", state(slice(None), 0.0), (RUNS, joints))
    if failures or np.abs(at_rest).max() > 1e-12:
        problems.append(f"{name}.command does not give zero velocity for zero error")
    rate = np.einsum("kb,kcb,cjb,bj->b", e, L, J, qd)
    if (rate >= 0).any():
        problems.append(
            f"{name}.command does not descend: e' L J qdot is {rate.max():.3g}, not negative; "
            "look at the sign of the command"
        )
    return problems


def check_joint(
    kind: JointKind, seed: int = 0, runs: int = RUNS, *, bits: bool = False
) -> list[str]:
    """Check that a joint's twists are the derivative of its motion, row by row.

    At random coordinates the motion is a pose, and the twist of each velocity is compared with
    central differences of it, whose error must shrink with the square of the step. Rows alone may
    differ by rounding, as with `check_feature`; with `bits` they must be the same.
    """
    if not isinstance(kind, JointKind):
        return [f"expected a JointKind, got {format_value(kind)}"]
    try:
        check_joint_kind(kind)
    except InputError as reason:
        return [str(reason)]
    runs = as_integer(runs, "runs", 1, MOST)
    rng = np.random.default_rng(as_integer(seed, "seed", 0))
    q = kind.sample(rng.random((runs, len(kind.rest))), kind.rest, kind.ranges(None, None))
    nv, name = len(kind.velocities), type(kind).__name__
    T, problems = _call_and_check(kind, "motion", q, (runs, 4, 4))
    V, failures = _call_and_check(kind, "twists", q, (runs, nv, 6))
    if problems or failures:
        return problems + failures
    rigid = np.abs(np.einsum("bij,bkj->bik", T[:, :3, :3], T[:, :3, :3]) - np.eye(3)).max()
    if rigid > 1e-12 or (T[:, 3] != [0, 0, 0, 1]).any() or (np.linalg.det(T) < 0).any():
        return [
            f"{name}.motion is no pose: R R' differs from the identity by {rigid:.3g}, or R is"
            " a mirror, or the last row is not (0, 0, 0, 1)"
        ]
    if nv:
        columns = [f"{name}.twists, velocity '{velocity}'" for velocity in kind.velocities]
        scales, off = 1.0 + np.abs(V).max((0, 2)), partial(_subtract_twists, kind, q)
        problems += _check_against_differences(columns, off, V.swapaxes(1, 2), scales, "motion")
    least = 0.0 if as_bool(bits, "bits") else ROUNDING
    problems += _check_rows_alone(lambda rows: kind.motion(q[rows]), T, f"{name}.motion", least)
    return problems + _check_rows_alone(
        lambda rows: kind.twists(q[rows]), V, f"{name}.twists", least
    )


@dataclass(frozen=True)
class _RandomViews:
    """Random views of some marks, from one camera and from a second one beside it."""

    marks: Array  # (N, 3)
    T_c_o: Array  # (3, 4, B)

    @classmethod
    def random(cls, marks: Any, seed: int, runs: int, rotation: float = 0.6) -> _RandomViews:
        """Return views with the target 1.2 to 1.8 m ahead, turned by up to `rotation` rad."""
        rng, runs = (
            np.random.default_rng(as_integer(seed, "seed", 0)),
            as_integer(runs, "runs", 1, MOST),
        )
        if isinstance(marks, int):
            marks = rng.uniform(-0.3, 0.3, size=(as_integer(marks, "marks", 1, MOST), 3))
        turn = rng.uniform(-rotation, rotation, (runs, 3))
        T = np.array(Pose.exp(np.concatenate([np.zeros((runs, 3)), turn], axis=1)).matrix)
        T[:, :3, 3] = rng.uniform([-0.2, -0.2, 1.2], [0.2, 0.2, 1.8], (runs, 3))
        given = as_floats(marks, "marks", ("N", 3))
        if given.ndim != 2 or not given.size:
            raise InputError(f"marks: expected (N, 3), or how many, got shape {given.shape}")
        return cls(given, move_runs_last(T[:, :3], 2))

    def some(self, rows: Any) -> _RandomViews:
        """Return the views of some runs."""
        return _RandomViews(self.marks, np.ascontiguousarray(self.T_c_o[..., rows]))

    def moved(self, twist: Array) -> _RandomViews:
        """Return the views after the camera moved by exp(twist)."""
        T = Pose.exp(twist).inv().matrix @ homogeneous_matrix(self.T_c_o)
        return _RandomViews(self.marks, move_runs_last(T[:, :3], 2))

    def observed(self, feature: Feature) -> Observation:
        """Return the observation that the feature gets."""
        if getattr(feature, "cameras", 1) != 2:
            return self._by(CAMERA)
        T = BETWEEN.inv().matrix @ homogeneous_matrix(self.T_c_o)
        other = _RandomViews(self.marks, move_runs_last(T[:, :3], 2))._by(OTHER_CAMERA)
        between = np.broadcast_to(BETWEEN.matrix[:3, :, None], self.T_c_o.shape)
        return self._by(CAMERA, other=other, between_last=make_read_only(between.copy()))

    def _by(self, camera: Camera, **more: Any) -> Observation:
        T = self.T_c_o
        x, y, z = np.moveaxis(self.marks[..., None, None], 1, 0)  # the same bits in any batch
        X = ((T[:, 0] * x + T[:, 1] * y) + T[:, 2] * z) + T[:, 3]
        pixels, _ = camera.image_of(X)
        more |= {"model": self.marks, "guess_last": self.T_c_o}
        depth = make_read_only(np.ascontiguousarray(X[:, 2]))
        return Observation.of_last(make_read_only(pixels), depth, camera, **more)


def _check_attributes(feature: Feature) -> list[str]:
    name = type(feature).__name__
    problems = []
    if not isinstance(getattr(feature, "unit", None), str):
        problems.append(f"{name}.unit must be a string such as 'px' or '1'")
    tolerance = getattr(feature, "tolerance", None)
    if not isinstance(tolerance, int | float) or not 0 < tolerance < np.inf:
        problems.append(f"{name}.tolerance must be a positive number, got {tolerance!r}")
    return problems


def _call_and_check(
    owner: Any, method: str, given: Any, shape: tuple[int | None, ...]
) -> tuple[Array, list[str]]:
    """Return what a method returns, and a list of what is wrong with it."""
    who = f"{type(owner).__name__}.{method}"
    if not callable(getattr(owner, method, None)):
        return np.empty(0), [f"{who} is missing"]
    returned = getattr(owner, method)(given)
    try:
        value = np.asarray(returned)
    except ValueError:
        return np.empty(0), [f"{who} returned rows of unequal lengths"]
    fits = value.ndim == len(shape) and all(
        wanted in (None, size) for wanted, size in zip(shape, value.shape, strict=True)
    )
    if not fits:
        wanted = tuple("k" if n is None else n for n in shape)
        return value, [
            f"{who} returned shape {value.shape}; for {shape[0]} runs it must be {wanted}"
        ]
    if not np.issubdtype(value.dtype, np.number) or not np.isfinite(value).all():
        return value, [f"{who} returned numbers that are not finite"]
    return value.astype(np.float64), []


def _check_against_differences(
    columns: list[str], off: Callable[[float, Array], Array], exact: Array, scales: Array, of: str
) -> list[str]:
    """Check that what central differences are off falls with the square of the step.

    `off(step, exact)` is by how much (B, k, n) they differ from n columns that should be exact.
    """
    errors = np.array([np.abs(off(step, exact)).max((0, 1)) for step in STEPS])
    minus = np.abs(off(STEPS[-1], -exact)).max((0, 1))
    problems = []
    for who, (first, *_, last), opposite, scale in zip(
        columns, errors.T, minus, scales, strict=True
    ):
        if not (last < 1e-9 * scale or last < 0.3 * first):
            hint = "; the sign is flipped" if opposite < 1e-3 * scale else ""
            problems.append(
                f"{who}: differs from central differences of {of} by {last:.3g}, and not less for "
                f"smaller steps{hint}"
            )
    return problems


def _subtract_interaction(feature: Feature, views: _RandomViews, step: float, L: Array) -> Array:
    """Return central differences of s (B, k, 6) less L, without half turns where angles jump."""
    found = []
    for V in step * np.eye(6):
        ahead, behind = (feature.measure(views.moved(v).observed(feature)) for v in (V, -V))
        found.append((np.asarray(ahead) - np.asarray(behind)) / (2 * step))
    off, jump = np.stack(found, axis=-1) - L, np.pi / (2 * step)
    return np.asarray(off - jump * np.round(off / jump))


def _subtract_twists(kind: JointKind, q: Array, step: float, V: Array) -> Array:
    """Return central differences of the motion (B, 6, nv), as twists in its axes, less V."""
    axes, found = Pose(kind.motion(q)).rotation, []
    for rates in np.eye(V.shape[-1]):
        qd = np.tile(rates, (len(q), 1))
        ahead, behind = (Pose(kind.motion(kind.integrate(q, qd, s))) for s in (step, -step))
        v = np.einsum("bij,bi->bj", axes, ahead.position - behind.position)
        found.append(np.concatenate([v, (behind.inv() @ ahead).rotvec], axis=1) / (2 * step))
    return np.stack(found, axis=-1) - V


def _check_rows_alone(
    call: Callable[[Any], Any], all_rows: Array, who: str, share: float
) -> list[str]:
    """Check that each row alone is the same as in the batch, to a share of the largest number."""
    allowed = share * np.abs(all_rows).max(initial=0.0)
    for b in range(len(all_rows)):
        alone = np.asarray(call(slice(b, b + 1)), dtype=np.float64)
        off = np.abs(alone[0] - all_rows[b]).max(initial=0.0)
        if not off <= allowed:
            wanted = f"more than rounding ({allowed:.1g})" if share else "not to the last bit"
            return [
                f"{who}: run {b} alone differs from the same run in a batch by {off:.3g}, "
                f"{wanted}; compute element by element over the runs (matrix products of BLAS "
                "depend on the batch size)"
            ]
    return []
