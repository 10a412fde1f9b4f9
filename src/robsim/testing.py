"""Checks for your own features and laws: each returns sentences, none if all is well.

>>> from robsim import Points, JointLaw
>>> check_feature(Points()), check_law(JointLaw())
([], [])
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from robsim.arrays import Array
from robsim.camera import Camera
from robsim.features.feature import Feature, Observation
from robsim.kernels import camera as kernels
from robsim.pose import Pose
from robsim.servo.inverse import Truncated, product
from robsim.servo.law import Law, State

RUNS, MARKS = 5, 4
STEPS = (1e-2, 5e-3, 2.5e-3)  # of camera motion, metres and radians


def check_feature(feature: Feature, marks: int = MARKS, seed: int = 0) -> list[str]:
    """Whether measure and interaction fit together, and rows do not depend on the batch.

    L is compared with central differences of s along each of the six camera motions; their
    error must shrink with the square of the step, which a wrong sign or factor cannot do.
    """
    camera = Camera([[800, 0, 320], [0, 820, 240], [0, 0, 1]])
    X = _marks_in_camera(marks, seed)
    seen = _observe(camera, X)
    problems = _attributes(feature)
    s, said = _call(feature, "measure", seen, (RUNS, None))
    if not said:
        L, said = _call(feature, "interaction", seen, (RUNS, s.shape[1], 6))
    if said:
        return [*problems, *said]
    problems += _compare_with_differences(feature, camera, X, L)
    problems += _batch(lambda rows: feature.measure(_observe(camera, X[..., rows])), s, "measure")
    problems += _batch(
        lambda rows: feature.interaction(_observe(camera, X[..., rows])), L, "interaction"
    )
    return problems


def check_law(law: Law, joints: int = 6, features: int = 8, seed: int = 0) -> list[str]:
    """Whether a law gives finite commands of the right shape, zero for no error, descending.

    Descending means e' L J qdot < 0: for an exact model the error begins to shrink.
    """
    rng = np.random.default_rng(seed)
    e = rng.normal(size=(features, RUNS))
    L, J = rng.normal(size=(features, 6, RUNS)), rng.normal(size=(6, joints, RUNS))

    def state(rows: Any, scale: float = 1.0) -> State:
        error, M, N = (np.ascontiguousarray(a[..., rows]) for a in (scale * e, L, J))
        return State(error, M, N, product(M, N), gain=1.0, inverse=Truncated())

    name = type(law).__name__
    qd, said = _call(law, "command", state(slice(None)), (RUNS, joints))
    if said:
        return said
    problems = _batch(lambda rows: law.command(state(rows)), qd, "command", name)
    at_rest, said = _call(law, "command", state(slice(None), 0.0), (RUNS, joints))
    if said or np.abs(at_rest).max() > 1e-12:
        problems.append(f"{name}.command does not give zero velocity for zero error")
    rate = np.einsum("kb,kcb,cjb,bj->b", e, L, J, qd)
    if (rate >= 0).any():
        problems.append(
            f"{name}.command does not descend: e' L J qdot is {rate.max():.3g}, not negative; "
            "look at the sign of the command"
        )
    return problems


def _marks_in_camera(marks: int, seed: int) -> Array:
    """(N, 3, RUNS) points between one and two metres in front of the camera."""
    rng = np.random.default_rng(seed)
    X = rng.uniform(-0.4, 0.4, size=(marks, 3, RUNS))
    X[:, 2] += 1.5
    return X


def _observe(camera: Camera, X: Array) -> Observation:
    X = np.ascontiguousarray(X)
    pixels = np.empty((X.shape[0], 2, X.shape[2]))
    kernels.project(X, camera.K, camera.lens, pixels)
    return Observation.of(pixels, np.ascontiguousarray(X[:, 2]), camera)


def _attributes(feature: Feature) -> list[str]:
    name = type(feature).__name__
    problems = []
    if not isinstance(getattr(feature, "unit", None), str):
        problems.append(f"{name}.unit must be a string such as 'px' or '1'")
    tolerance = getattr(feature, "tolerance", None)
    if not isinstance(tolerance, int | float) or not 0 < tolerance < np.inf:
        problems.append(f"{name}.tolerance must be a positive number, got {tolerance!r}")
    return problems


def _call(
    owner: Any, method: str, given: Any, shape: tuple[int | None, ...]
) -> tuple[Array, list[str]]:
    """What a method returns, and what is wrong with it."""
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
        return value, [f"{who} returned shape {value.shape}; for {RUNS} runs it must be {wanted}"]
    if not np.issubdtype(value.dtype, np.number) or not np.isfinite(value).all():
        return value, [f"{who} returned numbers that are not finite"]
    return value.astype(np.float64), []


def _compare_with_differences(feature: Feature, camera: Camera, X: Array, L: Array) -> list[str]:
    name = type(feature).__name__
    errors = np.array([np.abs(_differences(feature, camera, X, h) - L).max((0, 1)) for h in STEPS])
    scale = 1.0 + np.abs(L).max()
    motions = ("vx", "vy", "vz", "wx", "wy", "wz")
    problems = []
    for i, motion in enumerate(motions):
        small = errors[-1, i] < 1e-9 * scale
        if not (small or errors[-1, i] < 0.3 * errors[0, i]):
            minus = np.abs(_differences(feature, camera, X, STEPS[-1]) + L).max((0, 1))[i]
            hint = "; the sign is flipped" if minus < 1e-3 * scale else ""
            problems.append(
                f"{name}.interaction, column {motion}: differs from central differences of measure "
                f"by {errors[-1, i]:.3g}, and not less for smaller steps{hint}"
            )
    return problems


def _differences(feature: Feature, camera: Camera, X: Array, step: float) -> Array:
    """(RUNS, k, 6) central differences of s along the six camera motions."""
    columns = []
    for axis in range(6):
        V = np.zeros(6)
        V[axis] = step
        ahead = feature.measure(_observe(camera, _moved(X, V)))
        behind = feature.measure(_observe(camera, _moved(X, -V)))
        columns.append((np.asarray(ahead) - np.asarray(behind)) / (2 * step))
    return np.stack(columns, axis=-1)


def _moved(X: Array, twist: Array) -> Array:
    """Points in the axes of a camera that moved by exp(twist)."""
    T = Pose.exp(twist).inv()
    moved: Array = np.einsum("rc,ncb->nrb", T.rotation, X) + T.position[:, None]
    return moved


def _batch(call: Callable[[Any], Any], all_rows: Array, method: str, name: str = "") -> list[str]:
    """Whether each row alone gives the same bits as in the batch."""
    who = f"{name}.{method}" if name else method
    for b in range(RUNS):
        alone = np.asarray(call(slice(b, b + 1)), dtype=np.float64)
        if not np.array_equal(alone[0], all_rows[b]):
            return [
                f"{who}: run {b} alone differs from the same run in a batch by "
                f"{np.abs(alone[0] - all_rows[b]).max():.3g}; compute element by element over the "
                "runs (matrix products of BLAS depend on the batch size)"
            ]
    return []
