"""Checks for user-defined features, laws and joints.

Each function returns a list of the problems; the list is empty if there are none.

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
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_bool, as_floats, as_integer, make_read_only, move_runs_last
from robsim.base.errors import InputError, format_value
from robsim.base.protocols import describe_protocol, implements
from robsim.features.feature import Feature, Observation, reads_pictures
from robsim.geometry.pose import Pose, homogeneous_matrix
from robsim.robot.joints.joint_kind import JointKind, check_joint_kind
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.inverse import PseudoInverse, multiply_batches
from robsim.servo.laws.law import Law
from robsim.vision.camera import Camera

__all__ = ["check_feature", "check_joint", "check_law"]


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__


RUNS, MARKS = 5, 4
MOST = 10_000  # largest number of runs, marks, joints or features
CAMERA = Camera([[800, 0, 320], [0, 820, 240], [0, 0, 1]])
OTHER_CAMERA = Camera([[700, 3, 330], [0, 690, 250], [0, 0, 1]], distortion=(-0.1, 0.02, 0, 0))
BETWEEN = Pose.at(0.25, 0.02, -0.03, rpy=(0.02, -0.15, 0.05))  # second camera in the first
ROUNDING = 1e-12  # share of the largest number; smaller differences come from the order of sums
MOTIONS = ("vx", "vy", "vz", "wx", "wy", "wz")  # components of a camera twist
STEPS = (1e-2, 5e-3, 2.5e-3)  # of camera motion, metres and radians


def check_feature(
    feature: Feature,
    marks: ArrayLike = MARKS,
    seed: int = 0,
    runs: int = RUNS,
    *,
    bits: bool = False,
) -> list[str]:
    """Check that the interaction matrix of a feature is the derivative of its measurement.

    The interaction matrix L is compared with central differences of the feature s along each of the
    six camera motions in random views. If L is correct, the deviation decreases with the square of
    the step; a wrong sign or factor leaves a constant deviation. The function also checks the unit
    and the tolerance of the feature, and that a run gives the same numbers alone and in a batch.

    Parameters
    ----------
    feature : Feature
        Feature to check.
    marks : array_like of shape (N, 3) or int, default 4
        Feature points in axes of the target, or the number of random points.
    seed : int, default 0
        Seed of the random views and points.
    runs : int, default 5
        Number of views.
    bits : bool, default False
        Whether a run alone must agree with the same run in a batch to the last bit, as for the
        features of RobSim. By default they may differ by 1e-12 of the largest number.

    Returns
    -------
    list of str
        The problems; empty if there are none.

    Raises
    ------
    InputError
        If `feature` is not a feature or uses pictures, or an option is invalid.

    Examples
    --------
    >>> from robsim.features import Points
    >>> class Flipped(Points):
    ...     def interaction(self, seen):
    ...         return -super().interaction(seen)
    >>> len(check_feature(Flipped()))
    6
    """
    least = 0.0 if as_bool(bits, "bits") else ROUNDING
    if not implements(feature, Feature):
        expected = describe_protocol(Feature)
        raise InputError(f"expected a feature, {expected}, got {format_value(feature)}")
    if reads_pictures(feature):
        raise InputError(
            f"{type(feature).__name__} uses pictures, and this check moves marks: simulate it"
        )
    views = _RandomViews.random(marks, seed, runs)
    if hasattr(feature, "towards"):
        goal = _RandomViews.random(views.marks, seed + 1, 1, rotation=0.3)
        feature = feature.towards(goal.observe(feature))
    observation = views.observe(feature)
    problems = _check_attributes(feature)
    s, failures = _call_and_check(feature, "measure", observation, (runs, None))
    if failures:
        return [*problems, *failures]

    def alone(rows: Any) -> Observation:
        return views.select_runs(rows).observe(feature)

    problems += _check_rows_alone(lambda rows: feature.measure(alone(rows)), s, "measure", least)
    if not hasattr(feature, "interaction"):
        return problems
    L, failures = _call_and_check(feature, "interaction", observation, (runs, s.shape[1], 6))
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
    """Check that a law returns finite velocities that reduce the error, and zero at the goal.

    The function samples random errors e and matrices L and J, and checks the sign of

        d/dt |e|^2 / 2 = e' L J qdot,

    which must be negative for the commanded velocities qdot. It also checks that the velocities are
    zero for e = 0, and that a run gives the same numbers alone and in a batch.

    Parameters
    ----------
    law : Law
        Law to check.
    joints : int, default 6
        Number of joint velocities.
    features : int, default 8
        Number of feature components.
    seed : int, default 0
        Seed of the random errors and matrices.
    bits : bool, default False
        Whether a run alone must agree with the same run in a batch to the last bit. Then the runs
        of a simulation do not depend on their distribution among threads. By default they may
        differ by 1e-12 of the largest number.

    Returns
    -------
    list of str
        The problems; empty if there are none.

    Raises
    ------
    InputError
        If an option is invalid.

    Examples
    --------
    >>> from robsim.laws import JointLaw
    >>> class Zero(JointLaw):
    ...     def command(self, state):
    ...         return 0.0 * super().command(state)
    >>> [problem.split(":")[0] for problem in check_law(Zero())]
    ['Zero.command does not descend']
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
        problems.append(f"{name}.command does not return zero velocity for zero error")
    rate = np.einsum("kb,kcb,cjb,bj->b", e, L, J, qd)
    if (rate >= 0).any():
        problems.append(
            f"{name}.command does not descend: e' L J qdot is {rate.max():.3g}, not negative; "
            "check the sign of the command"
        )
    return problems


def check_joint(
    kind: JointKind, seed: int = 0, runs: int = RUNS, *, bits: bool = False
) -> list[str]:
    """Check that the twists of a joint kind are the derivatives of its motion.

    The motion must be a pose at random coordinates. The twist of each velocity is compared with
    central differences of the motion; if the twists are correct, the deviation decreases with the
    square of the step. Each row must give the same numbers alone and in a batch.

    Parameters
    ----------
    kind : JointKind
        Joint kind to check.
    seed : int, default 0
        Seed of the random coordinates.
    runs : int, default 5
        Number of rows of coordinates.
    bits : bool, default False
        Whether a row alone must agree with the same row in a batch to the last bit. By default they
        may differ by 1e-12 of the largest number.

    Returns
    -------
    list of str
        The problems; empty if there are none.

    Raises
    ------
    InputError
        If an option is invalid.

    Examples
    --------
    >>> from robsim.joints import JointKind
    >>> class Lift(JointKind):  # moves along z
    ...     name, coordinates, units = "lift", ("",), ("m",)
    ...     def motion(self, q):
    ...         T = np.tile(np.eye(4), (len(q), 1, 1))
    ...         T[:, 2, 3] = q[:, 0]
    ...         return T
    ...     def twists(self, q):
    ...         return np.tile([0, 0, 1.0, 0, 0, 0], (len(q), 1, 1))
    >>> check_joint(Lift())
    []
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
            f"{name}.motion is not a pose: R R' differs from the identity by {rigid:.3g}, or R is"
            " a mirror, or the last row is not (0, 0, 0, 1)"
        ]
    if nv:
        columns = [f"{name}.twists, velocity '{velocity}'" for velocity in kind.velocities]
        scales, subtract = 1.0 + np.abs(V).max((0, 2)), partial(_subtract_twists, kind, q)
        problems += _check_against_differences(
            columns, subtract, V.swapaxes(1, 2), scales, "motion"
        )
    least = 0.0 if as_bool(bits, "bits") else ROUNDING
    problems += _check_rows_alone(lambda rows: kind.motion(q[rows]), T, f"{name}.motion", least)
    return problems + _check_rows_alone(
        lambda rows: kind.twists(q[rows]), V, f"{name}.twists", least
    )


@dataclass(frozen=True)
class _RandomViews:
    """Random views of feature points from one camera, and from a second camera beside it."""

    marks: Array  # (N, 3)
    T_c_o: Array  # (3, 4, B)

    @classmethod
    def random(cls, marks: ArrayLike, seed: int, runs: int, rotation: float = 0.6) -> _RandomViews:
        """Return views with the target 1.2 to 1.8 m ahead, rotated by up to `rotation` rad."""
        rng, runs = (
            np.random.default_rng(as_integer(seed, "seed", 0)),
            as_integer(runs, "runs", 1, MOST),
        )
        if isinstance(marks, int):
            marks = rng.uniform(-0.3, 0.3, size=(as_integer(marks, "marks", 1, MOST), 3))
        turn = rng.uniform(-rotation, rotation, (runs, 3))
        T = np.array(Pose.exp(np.concatenate([np.zeros((runs, 3)), turn], axis=1)).matrix)
        T[:, :3, 3] = rng.uniform([-0.2, -0.2, 1.2], [0.2, 0.2, 1.8], (runs, 3))
        points = as_floats(marks, "marks", ("N", 3))
        if points.ndim != 2 or not points.size:
            raise InputError(f"marks: expected shape (N, 3) or a number, got shape {points.shape}")
        return cls(points, move_runs_last(T[:, :3], 2))

    def select_runs(self, rows: Any) -> _RandomViews:
        """Return the views of the selected runs."""
        return _RandomViews(self.marks, np.ascontiguousarray(self.T_c_o[..., rows]))

    def move_camera(self, twist: Array) -> _RandomViews:
        """Return the views after a motion exp(twist) of the camera."""
        T = Pose.exp(twist).inv().matrix @ homogeneous_matrix(self.T_c_o)
        return _RandomViews(self.marks, move_runs_last(T[:, :3], 2))

    def observe(self, feature: Feature) -> Observation:
        """Return the observation of the camera, or of both cameras if the feature needs two."""
        if getattr(feature, "cameras", 1) != 2:
            return self._observe_with(CAMERA)
        T = BETWEEN.inv().matrix @ homogeneous_matrix(self.T_c_o)
        other = _RandomViews(self.marks, move_runs_last(T[:, :3], 2))._observe_with(OTHER_CAMERA)
        T_between = np.broadcast_to(BETWEEN.matrix[:3, :, None], self.T_c_o.shape)
        return self._observe_with(
            CAMERA, other=other, between_last=make_read_only(T_between.copy())
        )

    def _observe_with(self, camera: Camera, **options: Any) -> Observation:
        """Return the observation of one camera."""
        T = self.T_c_o
        x, y, z = np.moveaxis(
            self.marks[..., None, None], 1, 0
        )  # elementwise: the same bits in any batch
        X = ((T[:, 0] * x + T[:, 1] * y) + T[:, 2] * z) + T[:, 3]
        pixels, _ = camera.image_of(X)
        options |= {"model": self.marks, "guess_last": self.T_c_o}
        depth = make_read_only(np.ascontiguousarray(X[:, 2]))
        return Observation.of_last(make_read_only(pixels), depth, camera, **options)


def _check_attributes(feature: Feature) -> list[str]:
    """Return the problems of the unit and the tolerance of a feature."""
    name = type(feature).__name__
    problems = []
    if not isinstance(getattr(feature, "unit", None), str):
        problems.append(f"{name}.unit must be a string such as 'px' or '1'")
    tolerance = getattr(feature, "tolerance", None)
    if not isinstance(tolerance, int | float) or not 0 < tolerance < np.inf:
        problems.append(f"{name}.tolerance must be a positive number, got {tolerance!r}")
    return problems


def _call_and_check(
    owner: Any, method: str, argument: Any, shape: tuple[int | None, ...]
) -> tuple[Array, list[str]]:
    """Return the result of a method as an array of a shape, and the problems of the result."""
    label = f"{type(owner).__name__}.{method}"
    if not callable(getattr(owner, method, None)):
        return np.empty(0), [f"{label} is missing"]
    result = getattr(owner, method)(argument)
    try:
        value = np.asarray(result)
    except ValueError:
        return np.empty(0), [f"{label} returned rows of unequal lengths"]
    fits = value.ndim == len(shape) and all(
        expected in (None, size) for expected, size in zip(shape, value.shape, strict=True)
    )
    if not fits:
        expected = tuple("k" if n is None else n for n in shape)
        return value, [
            f"{label} returned shape {value.shape}; for {shape[0]} runs it must be {expected}"
        ]
    if not np.issubdtype(value.dtype, np.number) or not np.isfinite(value).all():
        return value, [f"{label} returned numbers that are not finite"]
    return value.astype(np.float64), []


def _check_against_differences(
    columns: list[str],
    subtract: Callable[[float, Array], Array],
    exact: Array,
    scales: Array,
    of: str,
) -> list[str]:
    """Return a problem for each column if its central differences do not converge.

    `subtract(step, exact)` returns the deviation (B, k, n) of central differences from the columns
    `exact`. The deviation must decrease with the square of the step.
    """
    errors = np.array([np.abs(subtract(step, exact)).max((0, 1)) for step in STEPS])
    minus = np.abs(subtract(STEPS[-1], -exact)).max((0, 1))
    problems = []
    for name, (first, *_, last), opposite, scale in zip(
        columns, errors.T, minus, scales, strict=True
    ):
        if not (last < 1e-9 * scale or last < 0.3 * first):
            hint = "; the sign is flipped" if opposite < 1e-3 * scale else ""
            problems.append(
                f"{name}: differs from central differences of {of} by {last:.3g}, which "
                f"does not decrease with the step{hint}"
            )
    return problems


def _subtract_interaction(feature: Feature, views: _RandomViews, step: float, L: Array) -> Array:
    """Return central differences (B, k, 6) of s minus L, without jumps of angles by half turns."""
    differences = []
    for V in step * np.eye(6):
        ahead, behind = (feature.measure(views.move_camera(v).observe(feature)) for v in (V, -V))
        differences.append((np.asarray(ahead) - np.asarray(behind)) / (2 * step))
    deviation, jump = np.stack(differences, axis=-1) - L, np.pi / (2 * step)
    return np.asarray(deviation - jump * np.round(deviation / jump))


def _subtract_twists(kind: JointKind, q: Array, step: float, V: Array) -> Array:
    """Return central differences (B, 6, nv) of the motion minus V, as twists in its axes."""
    axes, differences = Pose(kind.motion(q)).rotation, []
    for rates in np.eye(V.shape[-1]):
        qd = np.tile(rates, (len(q), 1))
        ahead, behind = (Pose(kind.motion(kind.integrate(q, qd, s))) for s in (step, -step))
        v = np.einsum("bij,bi->bj", axes, ahead.position - behind.position)
        differences.append(np.concatenate([v, (behind.inv() @ ahead).rotvec], axis=1) / (2 * step))
    return np.stack(differences, axis=-1) - V


def _check_rows_alone(
    call: Callable[[Any], Any], all_rows: Array, label: str, share: float
) -> list[str]:
    """Return a problem if a row alone differs from the batch by more than `share`.

    `share` is relative to the largest number; 0 requires agreement to the last bit.
    """
    allowed = share * np.abs(all_rows).max(initial=0.0)
    for b in range(len(all_rows)):
        alone = np.asarray(call(slice(b, b + 1)), dtype=np.float64)
        off = np.abs(alone[0] - all_rows[b]).max(initial=0.0)
        if not off <= allowed:
            limit = f"more than rounding ({allowed:.1g})" if share else "not to the last bit"
            return [
                f"{label}: run {b} alone differs from the same run in a batch by {off:.3g}, "
                f"{limit}; compute elementwise over the runs, because the matrix products of "
                "BLAS depend on the batch size"
            ]
    return []
