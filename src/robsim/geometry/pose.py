"""Poses of one frame in another, as rigid transforms."""

from __future__ import annotations

import math
from typing import Any, Protocol, TypeVar, cast, overload

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from robsim.base.arrays import Array, as_floats, make_read_only, move_runs_first, move_runs_last
from robsim.base.errors import FrameError, InputError
from robsim.base.unit_warnings import warn_of_degrees
from robsim.geometry.rotation import ROTATION_TOLERANCE, axis_rotation, check_rigid, rotation_to_rpy
from robsim.kernels.formulas import se3

FrameNames = tuple[str, str]


def check_frame_names(frames: Any) -> FrameNames | None:
    """Return None or a tuple of two names; raise FrameError for any other value."""
    is_pair = isinstance(frames, tuple | list) and [type(f) for f in frames] == [str, str]
    if frames is not None and not is_pair:
        raise FrameError(f"frames are two names (a, b) for the pose of b in a, got {frames!r}")
    return (frames[0], frames[1]) if is_pair else None


def join_frame_names(left: FrameNames | None, right: FrameNames | None) -> FrameNames | None:
    """Return the names of T_a_b @ T_b_c; raise FrameError if the inner names differ."""
    if left is None or right is None:
        return None
    if left[1] != right[0]:
        raise FrameError(
            f"cannot join {left[0]}<-{left[1]} with {right[0]}<-{right[1]}: "
            f"'{left[1]}' does not meet '{right[0]}'"
        )
    return left[0], right[1]


M_co = TypeVar("M_co", covariant=True)


class Movable(Protocol[M_co]):
    """An object that a pose moves, such as a primitive, a robot or an inertia."""

    def at(self, pose: Pose, /) -> M_co:
        """Return a copy that is moved rigidly by a pose."""


class Pose:
    """Pose of a frame b in a frame a, or a batch of such poses.

    The rigid transform T_a_b maps the coordinates of a point in b to its coordinates in a,

        p_a = T_a_b @ p_b,

    and poses compose by the product T_a_c = T_a_b @ T_b_c. A pose is immutable. The frame names are
    optional. If both factors of a product have names, the inner names must agree: (a, b) @ (b, c).

    Parameters
    ----------
    matrix : array_like of shape (..., 4, 4), Pose, scipy RigidTransform or spatialmath SE3
        Homogeneous matrix with the position in metres. Leading dimensions make a batch of poses.
    frames : tuple of two str, optional
        Names (a, b) of the two frames.

    Attributes
    ----------
    matrix : ndarray of shape (..., 4, 4)
        Homogeneous matrix, read-only.
    frames : tuple of two str, or None
        Names (a, b) of the two frames.

    Raises
    ------
    InputError
        If a matrix is not a rigid transform, to 1e-6 in R'R.
    FrameError
        If `frames` is not a pair of names.

    Examples
    --------
    >>> T_w_b = Pose.at(1, 0, 0, rpy=(0, 0, np.pi / 2), frames=("world", "base"))
    >>> np.round(T_w_b @ [1, 0, 0], 12) + 0.0
    array([1., 1., 0.])
    >>> T_w_b @ Pose.at(0, 0, 0, frames=("tool", "cup"))
    Traceback (most recent call last):
    ...
    robsim...FrameError: cannot join world<-base with tool<-cup: 'base' does not meet 'tool'
    """

    __slots__ = ("frames", "matrix")
    matrix: Array
    frames: tuple[str, str] | None
    __array_ufunc__ = None  # so that array @ Pose calls __rmatmul__

    def __init__(self, matrix: PoseLike, frames: tuple[str, str] | None = None):
        T = as_floats(as_matrix(matrix), "pose", (4, 4))
        check_rigid(T)
        _set_pose_slots(self, T, frames)

    @classmethod
    def at(
        cls,
        x: ArrayLike = 0.0,
        y: ArrayLike = 0.0,
        z: ArrayLike = 0.0,
        *,
        rpy: ArrayLike = (0.0, 0.0, 0.0),
        rotvec: ArrayLike | None = None,
        frames: tuple[str, str] | None = None,
    ) -> Pose:
        """Return a pose by its position and by roll, pitch and yaw, as in URDF.

        The rotation is R = Rz(yaw) Ry(pitch) Rx(roll), or R = exp([rotvec]) if `rotvec` is given.
        Positions (...) and rotations (..., 3) with leading dimensions give a batch of poses.

        Parameters
        ----------
        x, y, z : array_like of shape (...), default 0
            Position of the origin, in metres.
        rpy : array_like of shape (..., 3), default (0, 0, 0)
            Roll, pitch and yaw, in radians.
        rotvec : array_like of shape (..., 3), optional
            Rotation vector, the unit axis times the angle in radians. It replaces `rpy`.
        frames : tuple of two str, optional
            Names (a, b) of the two frames.

        Returns
        -------
        Pose
            The pose, or a batch of poses.

        Raises
        ------
        InputError
            If both `rpy` and `rotvec` are given, or if the batches have unequal shapes.

        Warns
        -----
        UnitWarning
            If an angle looks like degrees.

        Examples
        --------
        >>> Pose.at(0, 0, 1, rotvec=(0, 0, np.pi)).matrix[:3, 3]
        array([0., 0., 1.])
        """
        if rotvec is not None:
            if as_floats(rpy, "rpy", (3,)).any():
                raise InputError("rpy and rotvec: give one rotation only")
            turn = as_floats(rotvec, "rotvec", (3,))
            warn_of_degrees(turn, "rotvec")
            rotation = _exponentiate_twists(
                np.concatenate([np.zeros(turn.shape), turn], -1), "rotvec"
            ).rotation
        else:
            turn = as_floats(rpy, "rpy", (3,))
            warn_of_degrees(turn, "rpy")
            r, p, y_ = np.moveaxis(turn, -1, 0)
            rotation = axis_rotation("z", y_) @ axis_rotation("y", p) @ axis_rotation("x", r)
        position = _stack_positions(x, y, z)
        lead = broadcast_leading_shape(
            rotation.shape[:-2], position.shape[:-1], "rotations and positions"
        )
        T = np.zeros((*lead, 4, 4))
        T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = rotation, position, 1.0
        return _make_pose(T, frames)

    @classmethod
    def exp(cls, twist: ArrayLike) -> Pose:
        """Return the motion of a constant twist over one unit of time.

        This is the exponential map of SE(3).

        Parameters
        ----------
        twist : array_like of shape (..., 6)
            Twist (v, omega): velocity of the origin and angular velocity, in axes of the moving
            frame.

        Returns
        -------
        Pose
            Pose of the frame after the motion, in the frame before it.

        Raises
        ------
        InputError
            If the twist is so large that the motion is not finite, from about 1e154 on.

        Examples
        --------
        >>> Pose.exp([1, 0, 0, 0, 0, 0]).position
        array([1., 0., 0.])
        """
        return _exponentiate_twists(as_floats(twist, "twist", (6,)), "twist")

    @classmethod
    def from_quaternion(cls, position: ArrayLike, quaternion: ArrayLike) -> Pose:
        """Return a pose by its position and a unit quaternion.

        Parameters
        ----------
        position : array_like of shape (..., 3)
            Position of the origin, in metres.
        quaternion : array_like of shape (..., 4)
            Unit quaternion (x, y, z, w), scalar last.

        Returns
        -------
        Pose
            The pose, or a batch of poses.

        Raises
        ------
        InputError
            If the norm of a quaternion differs from 1 by more than 1e-6.

        Examples
        --------
        >>> Pose.from_quaternion([0, 0, 1], [0, 0, 0, 1]).position
        array([0., 0., 1.])
        """
        p, c = as_floats(position, "position", (3,)), as_floats(quaternion, "quaternion", (4,))
        if (np.abs(np.linalg.norm(c, axis=-1) - 1.0) > ROTATION_TOLERANCE).any():
            raise InputError(f"quaternion (x, y, z, w) must have length 1, got {c.tolist()}")
        lead = broadcast_leading_shape(p.shape[:-1], c.shape[:-1], "position and quaternion")
        c = c / np.linalg.norm(c, axis=-1, keepdims=True)
        q = np.concatenate([np.broadcast_to(p, (*lead, 3)), np.broadcast_to(c, (*lead, 4))], -1)
        columns = move_runs_last(q, 1)
        T = np.empty((3, 4, columns.shape[-1]))
        se3.pose_from_quaternion(columns, T)
        return _make_pose(homogeneous_matrix(T, lead), None)

    @property
    def position(self) -> Array:
        """Position (..., 3) of the origin, in metres."""
        return self.matrix[..., :3, 3]

    @property
    def rotation(self) -> Array:
        """Rotation matrix (..., 3, 3)."""
        return self.matrix[..., :3, :3]

    @property
    def quaternion(self) -> Array:
        """Unit quaternion (..., 4) = (x, y, z, w) with w >= 0."""
        T = move_runs_last(self.matrix[..., :3, :], 2)
        out = np.empty((4, T.shape[-1]))
        se3.rotation_to_quaternion(T, out)
        return move_runs_first(out, self.matrix.shape[:-2])

    @property
    def rotvec(self) -> Array:
        """Rotation vector theta u (..., 3) in radians, with theta in [0, pi]."""
        quaternion = move_runs_last(self.quaternion, 1)
        out = np.empty((3, quaternion.shape[-1]))
        se3.rotation_vector(quaternion, out)
        return move_runs_first(out, self.matrix.shape[:-2])

    @property
    def rpy(self) -> Array:
        """Roll, pitch and yaw (3,) in radians of a single pose: R = Rz(yaw) Ry(pitch) Rx(roll)."""
        return np.array(rotation_to_rpy(self.rotation))

    def revised(self, **changes: ArrayLike) -> Pose:
        """Return a copy with another position, rotation, rpy or rotvec.

        Parameters
        ----------
        **changes : array_like
            New `position` (..., 3) in metres, and one of `rotation` (..., 3, 3), `rpy` (..., 3) and
            `rotvec` (..., 3) in radians. Leading axes give a batch of poses.

        Returns
        -------
        Pose
            The pose, without frame names.

        Examples
        --------
        >>> Pose.at(1, 2, 3).revised(position=(0, 0, 1)).position
        array([0., 0., 1.])
        """
        if changes.keys() & {"rpy", "rotvec"}:
            rotation_only = cast(dict[str, Any], changes)  # Any: one key of `at` or the other
            return Pose.at(*np.moveaxis(self.position, -1, 0), **rotation_only)
        position = np.asarray(changes.get("position", self.position), dtype=float)
        rotation = np.asarray(changes.get("rotation", self.rotation), dtype=float)
        lead = broadcast_leading_shape(
            rotation.shape[:-2], position.shape[:-1], "rotations and positions"
        )
        T = np.zeros((*lead, 4, 4))
        T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = rotation, position, 1.0
        return Pose(T)

    def held(self, **changes: Array) -> Pose:
        """Return a batch of poses, one for each run, from values (..., runs) as in `revised`."""
        return self.revised(**{name: np.moveaxis(x, -1, 0) for name, x in changes.items()})

    @property
    def q(self) -> Array:
        """Coordinates (..., 7) of a floating joint: position and quaternion (x, y, z, w)."""
        return np.concatenate([self.position, self.quaternion], axis=-1)

    def inv(self) -> Pose:
        """Return the inverse pose, T_b_a of T_a_b.

        Examples
        --------
        >>> Pose.at(1, 2, 3).inv().position
        array([-1., -2., -3.])
        """
        R = np.swapaxes(self.rotation, -1, -2)
        T = np.zeros_like(self.matrix)
        T[..., :3, :3], T[..., 3, 3] = R, 1.0
        T[..., :3, 3] = -(R @ self.position[..., None])[..., 0]
        return _make_pose(T, self.frames[::-1] if self.frames else None)

    @overload
    def __matmul__(self, other: Pose) -> Pose: ...
    @overload
    def __matmul__(self, other: Movable[M_co]) -> M_co: ...
    @overload
    def __matmul__(self, other: MatrixPose | ArrayPose) -> Pose: ...
    @overload
    def __matmul__(self, other: ArrayLike) -> Any: ...  # Any: see below
    def __matmul__(
        self, other: PoseLike | Movable[object]
    ) -> Any:  # Any: the shape of an array determines whether it is a pose or points
        """Return the product T_a_b @ T_b_c as a Pose, or points in frame a.

        Parameters
        ----------
        other : Pose, array_like, or an object with a method `at`
            A pose or its 4 x 4 matrix, points (3,) or (..., N, 3) in frame b in metres, or a
            primitive or robot, which is moved by the pose.

        Returns
        -------
        Pose, ndarray or the type of `other`
            The composed pose, the points (3,) or (..., N, 3) in frame a, or the moved object.

        Raises
        ------
        FrameError
            If both poses have frame names and the inner names differ.
        InputError
            If the batches have unequal shapes, or the product is not finite.
        """
        if hasattr(other, "at") and not isinstance(other, Pose):
            return other.at(self)  # a primitive, a robot
        if isinstance(other, Pose) or is_pose_like(other):
            right = as_pose(other)
            frames = join_frame_names(self.frames, right.frames)
            lead = self.matrix.shape[:-2], right.matrix.shape[:-2]
            broadcast_leading_shape(*lead, "poses that are joined")
            with np.errstate(over="ignore", invalid="ignore"):  # overflow raises an error below
                product = self.matrix @ right.matrix
            return _make_pose(_check_finite_pose(product, "product of poses"), frames)
        points = as_floats(other, "points", (3,))  # type: ignore[arg-type]  # raises for others
        if points.ndim == 1:
            return (self.rotation @ points) + self.position
        broadcast_leading_shape(self.matrix.shape[:-2], points.shape[:-2], "poses and points")
        return points @ np.swapaxes(self.rotation, -1, -2) + self.position[..., None, :]

    def __rmatmul__(self, other: PoseLike) -> Pose:
        """Return the product of a 4 x 4 array and this pose, as a Pose."""
        return as_pose(other) @ self

    def __getitem__(self, index: Any) -> Pose:  # Any: every index of NumPy
        """Return the poses of a batch at an index, mask or slice of its leading axes."""
        lead = self.matrix.shape[:-2]
        if not lead:
            raise InputError("this is a single pose, not a batch: it cannot be indexed")
        try:
            chosen = np.arange(math.prod(lead)).reshape(lead)[index]
        except IndexError as error:
            raise InputError(f"a batch of poses of shape {lead}: {error}") from None
        return _make_pose(self.matrix.reshape(-1, 4, 4)[chosen], self.frames)

    def __reduce__(self) -> tuple[Any, ...]:
        return _make_pose, (np.array(self.matrix), self.frames)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> Array:
        return np.array(self.matrix, dtype=dtype)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("a Pose is a value: make a new one")

    def __delattr__(self, name: str) -> None:
        raise AttributeError("a Pose is a value: make a new one")

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Pose)
            and self.frames == other.frames
            and np.array_equal(self.matrix, other.matrix)
        )

    def __hash__(self) -> int:
        return hash(((self.matrix + 0.0).tobytes(), self.frames))  # -0.0 equals 0.0

    def __repr__(self) -> str:
        name = f" {self.frames[0]}<-{self.frames[1]}" if self.frames else ""
        if self.matrix.ndim > 2:
            return f"<Pose{name} batch {self.matrix.shape[:-2]}>"
        p, w = np.round(self.position, 4) + 0.0, np.round(self.rotvec, 4) + 0.0
        return f"<Pose{name} position {p.tolist()} rotvec {w.tolist()}>"


def _exponentiate_twists(V: Array, what: str) -> Pose:
    """Return the motions of twists (..., 6); raise an InputError that names `what` on overflow."""
    columns = move_runs_last(V, 1)
    T = np.empty((3, 4, columns.shape[-1]))
    se3.exp_se3(columns, T)
    return _make_pose(homogeneous_matrix(_check_finite_pose(T, what), V.shape[:-1]), None)


def _check_finite_pose(T: Array, what: str) -> Array:
    """Return an array, or raise an InputError that names `what` if an entry is not finite."""
    if not np.isfinite(T).all():
        raise InputError(f"{what}: too large, so that the pose is not finite")
    return T


def _stack_positions(x: ArrayLike, y: ArrayLike, z: ArrayLike) -> Array:
    """Return positions (..., 3) from numbers or batches of numbers."""
    coordinates: Any = (x, y, z)
    if all(isinstance(arrays, int | float) for arrays in coordinates):
        return as_floats(coordinates, "position", (3,))
    arrays = [
        as_floats(value, f"position {name}", ())
        for name, value in zip("xyz", coordinates, strict=True)
    ]
    try:
        return np.stack(np.broadcast_arrays(*arrays), axis=-1)
    except ValueError:
        shapes = ", ".join(str(value.shape) for value in arrays)
        raise InputError(f"position: batches of unequal shapes {shapes}") from None


def broadcast_leading_shape(a: tuple[int, ...], b: tuple[int, ...], what: str) -> tuple[int, ...]:
    """Return the leading shape of two batches; raise an InputError that names `what` on a clash."""
    if a == b:
        return a
    try:
        return np.broadcast_shapes(a, b)
    except ValueError:
        raise InputError(f"{what}: batches of unequal shapes {a} and {b}") from None


def as_pose(value: object) -> Pose:
    """Return a Pose from a Pose, (..., 4, 4) array, SciPy RigidTransform or spatialmath SE3."""
    return value if isinstance(value, Pose) else Pose(cast(PoseLike, value))


def check_single_pose(value: object, what: str) -> Pose:
    """Return a single pose; raise an InputError that names `what` for any other value."""
    try:
        pose = as_pose(value)
    except InputError as error:
        raise InputError(f"{what}: {error}") from None
    if pose.matrix.ndim != 2:
        raise InputError(f"{what}: expected one pose, got a batch {pose.matrix.shape[:-2]}")
    return pose


def as_matrix(value: object) -> Any:  # Any: a value that is no pose is returned as it is
    """Return the matrix of a pose of RobSim, SciPy or spatialmath, or the value itself."""
    if isinstance(value, Pose):
        return value.matrix
    if hasattr(value, "as_matrix"):  # scipy.spatial.transform.RigidTransform
        return value.as_matrix()
    return getattr(value, "A", value)  # spatialmath.SE3 keeps its array as .A


def homogeneous_matrix(T: Array, lead: tuple[int, ...] = (-1,)) -> Array:
    """Return homogeneous matrices (*lead, 4, 4) from matrices (3, 4, b), with the run last.

    Examples
    --------
    >>> homogeneous_matrix(np.zeros((3, 4, 2))).shape
    (2, 4, 4)
    """
    out = np.zeros((T.shape[-1], 4, 4))
    out[:, :3], out[:, 3, 3] = np.moveaxis(T, -1, 0), 1.0
    return out.reshape(*lead, 4, 4)


def is_pose_like(value: object) -> bool:
    """Return whether a value is a Pose, a (..., 4, 4) array, or a pose of SciPy or spatialmath."""
    matrix = as_matrix(value)
    if matrix is not value:
        return True
    try:
        return bool(np.shape(matrix)[-2:] == (4, 4))  # type: ignore[call-overload]
    except ValueError:  # lists of unequal lengths
        return False


def _make_pose(T: Array, frames: tuple[str, str] | None) -> Pose:
    """Return a Pose from a matrix that is rigid by construction, without a check."""
    pose = object.__new__(Pose)
    _set_pose_slots(pose, T, frames)
    return pose


def _set_pose_slots(pose: Pose, T: Array, frames: tuple[str, str] | None) -> None:
    object.__setattr__(pose, "matrix", make_read_only(T))
    object.__setattr__(pose, "frames", check_frame_names(frames))


IDENTITY = Pose.at()


class MatrixPose(Protocol):
    """A pose of another library that returns its matrix, such as SciPy's RigidTransform."""

    def as_matrix(self) -> Any:  # Any: SciPy has no types
        """Return the matrix (..., 4, 4)."""


class ArrayPose(Protocol):
    """A pose of another library that stores its matrix as A, such as spatialmath's SE3."""

    A: Any  # Any: spatialmath has no types


PoseLike = Pose | ArrayLike | MatrixPose | ArrayPose
