"""The linear response of a task at rest: what it commands after small motions and pixel errors."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from robsim.analysis.vector_fields import STEP, ImageArrays, VectorField
from robsim.base.arrays import Array
from robsim.base.errors import InputError

PIXEL = 0.01  # of central differences
ROUGH = 0.02  # largest second difference over the first where a command counts as smooth
RANK_TOLERANCE = (
    1e-6  # share of the largest singular value below which a motion counts as left free
)


@dataclass(frozen=True, eq=False)
class LinearResponse:
    """The derivatives of the commanded velocities qd (n,) at a state of rest, per second.

    A motion (n,) is what the commanded velocities do in one second. A joint is read at once, and an
    image may come late: qd = now @ motion + seen @ motion when the image was taken
    + pixels @ errors in the image.
    """

    now: Array  # (n, n)
    seen: Array  # (n, n)
    pixels: Array  # (n, P) of the P = 2 N pixel coordinates of all sights
    marks: Array  # (P, n) true pixels over the motion
    place: Array  # (3, n) metres of the first camera in axes of its target, over the motion
    turn: Array  # (3, n) radians likewise

    @classmethod
    def of(cls, field: VectorField, q: Array) -> LinearResponse:
        """Return the response at a state of rest q (nq, 1), by central differences.

        InputError: the command has no derivative there, or does not depend on the state.
        """
        n = field.n
        there = field.moved(np.repeat(q, 2 * n, axis=1), STEP * _signed_steps(n))
        seen, before = field.images(there), field.images(np.repeat(q, 2 * n, axis=1))
        whole = field.respond(there, *seen)[0].qd
        _check_smooth_command(whole, field.command(q).qd)
        now = _central_difference(field.respond(there, *before)[0].qd, STEP)
        total = _central_difference(whole, STEP)
        place, turn = _relative_motion(field, q, there)
        marks = _central_difference(_stack_pixels(seen[0]), STEP)
        found = cls(now, total - now, _pixel_derivative(field, q), marks, place, turn)
        if not all(np.isfinite(getattr(found, each.name)).all() for each in fields(found)):
            raise InputError("advise: what is commanded beside the goal is not finite")
        return found

    @property
    def total(self) -> Array:
        """The derivative (n, n) of qd over a motion that the image shows at once."""
        return self.now + self.seen

    @cached_property
    def basis(self) -> Array:
        """An orthonormal basis (n, r) of the velocities that are ever commanded."""
        U, sigma, _ = np.linalg.svd(self.total)
        return np.ascontiguousarray(U[:, sigma > RANK_TOLERANCE * sigma[0]])

    def inside(self, A: Array) -> Array:
        """Return a map (n, n) of motions as (r, r), within the velocities that are commanded."""
        U = self.basis
        return np.asarray(U.T @ A @ U)

    def settled(self, qd: Array) -> Array:
        """Return the motion (n,) after which a command qd (n,) at rest is no more: qd + G x = 0."""
        U = self.basis
        found: Array = (
            -U @ np.linalg.pinv(self.inside(self.total), rcond=RANK_TOLERANCE) @ (U.T @ qd)
        )
        return found


def _signed_steps(n: int) -> Array:
    """Return (n, 2 n): a step ahead along each axis, then one behind."""
    return np.concatenate([np.eye(n), -np.eye(n)], axis=1)


def _central_difference(values: Array, step: float) -> Array:
    """Return derivatives (k, n) from values (k, 2 n) ahead and behind."""
    n = values.shape[1] // 2
    return np.asarray((values[:, :n] - values[:, n:]) / (2.0 * step))


def _stack_pixels(images: ImageArrays) -> Array:
    """Return the pixels (P, B) of all sights."""
    return np.concatenate([each.reshape(-1, each.shape[-1]) for each in images.values()])


def _pixel_derivative(field: VectorField, q: Array) -> Array:
    """Return the derivatives (n, P) of the command over the pixels."""
    pixels, depth = field.images(q)
    P = len(_stack_pixels(pixels))
    errors, first = PIXEL * _signed_steps(P), 0
    for key, each in pixels.items():
        rows = errors[first : first + each[..., 0].size].reshape(*each.shape[:2], 2 * P)
        pixels[key], first = each + rows, first + each[..., 0].size
    wide = {key: np.repeat(Z, 2 * P, axis=1) for key, Z in depth.items()}
    return _central_difference(
        field.respond(np.repeat(q, 2 * P, axis=1), pixels, wide)[0].qd, PIXEL
    )


def _relative_motion(field: VectorField, q: Array, there: Array) -> tuple[Array, Array]:
    """Return metres and radians (3, n) of the first camera in axes of its target."""
    here, poses = field.pose(q)[0].inv(), field.pose(there).inv()
    turned = here.inv() @ poses
    return _central_difference(poses.position.T, STEP), here.rotation @ _central_difference(
        turned.rotvec.T, STEP
    )


def _check_smooth_command(qd: Array, here: Array) -> None:
    """Raise InputError if the command (n, 2 n) has no derivative, or one that is zero."""
    n = qd.shape[1] // 2
    ahead, behind = qd[:, :n], qd[:, n:]
    size = np.abs(ahead - behind).max()
    if np.abs(ahead + behind - 2.0 * here).max() > ROUGH * size:
        raise InputError(
            "advise: the command has no derivative at the goal, so that no linear loop stands for "
            "it there (docking, for one): simulate it"
        )
    if size == 0.0:
        raise InputError("advise: the task commands nothing beside its goal; its L J is zero there")
