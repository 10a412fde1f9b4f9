"""The linear response of a task at rest: its command after small motions and pixel errors."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from robsim.analysis.vector_fields import ImageArrays, VectorField
from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.features.images.taken_pictures import TakenPictures

PIXEL = 0.01  # step of central differences
RANK_TOLERANCE = 1e-6  # least singular value of a commanded motion, relative to the largest


@dataclass(frozen=True, eq=False)
class LinearResponse:
    """Derivatives of the commanded velocities qd (n,) at a state of rest, in 1/s.

    A motion (n,) is the displacement that velocities produce in one second. Measured joints are up
    to date and images may be late, so that the two contributions are separate:

        qd = joint_part @ motion + image_part @ (motion in the image) + pixels @ (errors in the
        image).
    """

    joint_part: Array  # (n, n)
    image_part: Array  # (n, n)
    pixels: Array  # (n, P), with the P = 2 N pixel coordinates of all camera-target pairs
    marks: Array  # (P, n) derivative of the true pixels by the motion
    place: Array  # (3, n) derivative of the first camera's position in target axes
    turn: Array  # (3, n) derivative of its rotation in target axes

    @classmethod
    def of(cls, field: VectorField, q: Array) -> LinearResponse:
        """Return the response at a state of rest q (nq, 1), by central differences.

        Raises InputError if the command has no derivative, or does not depend on the state.
        """
        n = field.n
        displaced = field.displace(np.repeat(q, 2 * n, axis=1), field.step * _signed_steps(n))
        images, former_images = field.images(displaced), field.images(np.repeat(q, 2 * n, axis=1))
        commands = field.respond(displaced, *images)[0].qd
        _check_smooth_command(commands, field.command(q).qd, field.roughness)
        now = _central_difference(field.respond(displaced, *former_images)[0].qd, field.step)
        total = _central_difference(commands, field.step)
        place, turn = _relative_motion(field, q, displaced)
        marks = _central_difference(_stack_pixels(images.pixels), field.step)
        response = cls(now, total - now, _pixel_derivative(field, q), marks, place, turn)
        if not all(np.isfinite(getattr(response, each.name)).all() for each in fields(response)):
            raise InputError("advise: the command near the goal is not finite")
        return response

    @property
    def total(self) -> Array:
        """The derivative (n, n) of qd for images without delay."""
        return self.joint_part + self.image_part

    @cached_property
    def basis(self) -> Array:
        """An orthonormal basis (n, r) of the velocities that can be commanded."""
        U, sigma, _ = np.linalg.svd(self.total)
        return np.ascontiguousarray(U[:, sigma > RANK_TOLERANCE * sigma[0]])

    def restrict_map(self, A: Array) -> Array:
        """Return a map (n, n) of motions restricted to the commanded velocities, (r, r)."""
        U = self.basis
        return np.asarray(U.T @ A @ U)

    def cancelling_motion(self, qd: Array) -> Array:
        """Return the motion (n,) that cancels a command qd (n,) at rest: qd + G x = 0."""
        U = self.basis
        motion: Array = (
            -U @ np.linalg.pinv(self.restrict_map(self.total), rcond=RANK_TOLERANCE) @ (U.T @ qd)
        )
        return motion


def _signed_steps(n: int) -> Array:
    """Return unit steps (n, 2 n): one forward along each axis, then one backward."""
    return np.concatenate([np.eye(n), -np.eye(n)], axis=1)


def _central_difference(values: Array, step: float) -> Array:
    """Return derivatives (k, n) from values (k, 2 n) at forward and backward steps."""
    n = values.shape[1] // 2
    return np.asarray((values[:, :n] - values[:, n:]) / (2.0 * step))


def _stack_pixels(images: ImageArrays) -> Array:
    """Return the pixels (P, B) of all camera-target pairs."""
    return np.concatenate([each.reshape(-1, each.shape[-1]) for each in images.values()])


def _pixel_derivative(field: VectorField, q: Array) -> Array:
    """Return the derivatives (n, P) of the command with respect to the pixels."""
    pixels, depth, pictures = field.images(q)
    P = len(_stack_pixels(pixels))
    errors, first = PIXEL * _signed_steps(P), 0
    for key, each in pixels.items():
        rows = errors[first : first + each[..., 0].size].reshape(*each.shape[:2], 2 * P)
        pixels[key], first = each + rows, first + each[..., 0].size
    wide = {key: np.repeat(Z, 2 * P, axis=1) for key, Z in depth.items()}
    runs = np.arange(2 * P)
    same = {
        name: TakenPictures(np.repeat(each.grey, 2 * P, axis=0), runs)
        for name, each in pictures.items()
    }
    return _central_difference(
        field.respond(np.repeat(q, 2 * P, axis=1), pixels, wide, same)[0].qd, PIXEL
    )


def _relative_motion(field: VectorField, q: Array, displaced: Array) -> tuple[Array, Array]:
    """Return derivatives (3, n) of the first camera's position and rotation in target axes."""
    pose, poses = field.pose(q)[0].inv(), field.pose(displaced).inv()
    rotations = (pose.inv() @ poses).rotvec.T
    turn = pose.rotation @ _central_difference(rotations, field.step)
    return _central_difference(poses.position.T, field.step), turn


def _check_smooth_command(qd: Array, at_rest: Array, roughness: float) -> None:
    """Raise InputError if the command qd (n, 2 n) near rest has no or a zero derivative."""
    n = qd.shape[1] // 2
    ahead, behind = qd[:, :n], qd[:, n:]
    size = np.abs(ahead - behind).max()
    if np.abs(ahead + behind - 2.0 * at_rest).max() > roughness * size:
        raise InputError(
            "advise: the command has no derivative at the goal (as in docking), and so it has no "
            "linear loop: simulate it"
        )
    if size == 0.0:
        raise InputError("advise: the task commands nothing near its goal: its L J is zero")
