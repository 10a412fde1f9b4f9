"""The parameters of a calibration, and the predicted pixels with their derivatives.

The pixels of a mark p of the target are project(X^-1 A(q) Z s p), with the mount X = T_m_c of the
camera, the pose A = T_m_f of the frames from the joints, the pose Z = T_f_o of the target, and its
scale s: the true size relative to the marks of the scene.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, has_items, move_runs_first, move_runs_last
from robsim.base.errors import InputError, format_value, is_known_name, suggest_names
from robsim.base.value import Value
from robsim.calibration.calibration_views import CalibrationViews
from robsim.calibration.joint_chain import JointChain
from robsim.calibration.relative_motions import cross_matrix
from robsim.geometry.pose import Pose
from robsim.kernels.formulas import se3
from robsim.vision.camera import Camera
from robsim.vision.pixel_measurement import pixel_rate_matrices

POSE = ("x", "y", "z", "rx", "ry", "rz")
LENS = ("focal", "center", "distortion")
SCALE = "scale"  # name of the true size of the target, relative to its marks
INTRINSICS = ("fx", "fy", "cx", "cy")


@dataclass(frozen=True, eq=False)
class Unknowns(Value):
    """The estimated parameters, in the order of all vectors and matrices of a calibration.

    The first six parameters are the twist (v, omega) of the mount in camera axes, the next six the
    twist of the target in its own axes. Parameters of the lens, offsets of joints, and the scale of
    the target follow.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    lens: NDArray[np.int64]  # indices into `lens_names`: fx, fy, cx, cy, k1, k2, ...
    joints: NDArray[np.int64]  # indices of coordinates with an estimated offset
    scaled: bool = False  # whether the scale of the target is estimated

    @property
    def also(self) -> tuple[str, ...]:
        """The names of the parameters beside mount and target, as `calibrate` takes them."""
        groups = ["focal"] * 2 + ["center"] * 2 + ["distortion"] * 8
        lens = dict.fromkeys(groups[i] for i in self.lens.tolist())
        return (*lens, *self.names[12 + len(self.lens) :])

    @property
    def parts(self) -> dict[str, slice]:
        """The slices of the parameters of mount, target, lens, joints and scale."""
        lens, end = 12 + len(self.lens), len(self.names)
        joints = lens + len(self.joints)
        ends = {"mount": (0, 6), "target": (6, 12), "lens": (12, lens), "joints": (lens, joints)}
        return {name: slice(*pair) for name, pair in {**ends, SCALE: (joints, end)}.items()}


def select_unknowns(views: CalibrationViews, also: Iterable[str]) -> Unknowns:
    """Return the parameters to estimate from some views; raise InputError for an unknown name."""
    joints = dict(single_joints(views))
    if not has_items(also):
        raise InputError(f"also: expected a list of names, got {format_value(also)}")
    extra_names = tuple(also)
    known = [*LENS, SCALE, *joints]
    for name in extra_names:
        if not is_known_name(name, known):
            raise InputError(
                f"also: no {format_value(name)}; {suggest_names(name, known, 'names')}"
            )
    lens = _select_lens_numbers(views.lens, extra_names)
    offsets = [joints[name] for name in joints if name in extra_names]
    names = [f"{part}.{axis}" for part in ("mount", "target") for axis in POSE]
    known_names = lens_names(views.lens)
    names += [known_names[i] for i in lens] + [views.scene.coordinate_names[i] for i in offsets]
    units = ["m"] * 3 + ["rad"] * 3
    units = [*units, *units, *("px" if i < 4 else "1" for i in lens)]
    units += [views.scene.coordinate_units[i] for i in offsets]
    scaled = SCALE in extra_names
    indices = (np.array(lens, dtype=np.int64), np.array(offsets, dtype=np.int64))
    names, units = names + [SCALE] * scaled, units + ["1"] * scaled
    return Unknowns(tuple(names), tuple(units), *indices, scaled)


def lens_names(camera: Camera) -> tuple[str, ...]:
    """Return the names of the intrinsics and of the coefficients that its lens may have.

    >>> lens_names(Camera(np.eye(3), lens="fisheye"))
    ('fx', 'fy', 'cx', 'cy', 'k1', 'k2', 'k3', 'k4')
    """
    return (*INTRINSICS, *camera.model.names)


def single_joints(views: CalibrationViews) -> Iterable[tuple[str, int]]:
    """Return names and indices of the coordinates of joints with a single coordinate."""
    single = set(views.scene.tree.alone(np.arange(views.scene.nv)).tolist())
    return ((n, i) for i, n in enumerate(views.scene.coordinate_names) if i in single)


def _select_lens_numbers(camera: Camera, extra_names: tuple[str, ...]) -> list[int]:
    """Return the indices of the parameters of the lens to estimate."""
    count = len(camera.distortion)
    if "distortion" in extra_names and not count:
        raise InputError(
            "also: distortion: the camera has no coefficients; give the camera initial values, as "
            "in distortion=(0, 0, 0, 0)"
        )
    indices = {"focal": range(2), "center": range(2, 4), "distortion": range(4, 4 + count)}
    return [i for name in LENS if name in extra_names for i in indices[name]]


@dataclass(frozen=True, eq=False)
class CalibrationModel(Value):
    """The values of all parameters of a calibration."""

    mount: Pose  # X = T_m_c, the pose of the camera in the frame m that carries it
    place: Pose  # Z = T_f_o, the pose of the target in the frame f that carries it
    camera: Camera
    offsets: Array  # (nq,), added to the encoder coordinates
    scale: float = 1.0  # true size of the target, relative to the marks

    def add_step(self, step: Array, free: Unknowns) -> CalibrationModel:
        """Return the model after a step (P,); raise InputError if its lens or scale is invalid."""
        part = {name: step[indices] for name, indices in free.parts.items()}
        offsets = self.offsets.copy()
        offsets[free.joints] += part["joints"]
        scale = self.scale + float(part[SCALE].sum())
        if scale <= 0.0:
            raise InputError(f"scale: expected a positive number, got {scale:.3g}")
        return CalibrationModel(
            self.mount @ Pose.exp(part["mount"]),
            self.place @ Pose.exp(part["target"]),
            add_lens_step(self.camera, part["lens"], free.lens),
            offsets,
            scale,
        )

    def numbers(self, free: Unknowns) -> list[float]:
        """Return the estimated parameters of the lens, offsets of joints, and scale."""
        lens = _lens_numbers(self.camera, free.lens).tolist()
        return [*lens, *self.offsets[free.joints].tolist(), *[self.scale] * free.scaled]

    def step_to(self, other: CalibrationModel, free: Unknowns) -> Array:
        """Return the step (P,) from this model to another model: the inverse of `add_step`."""
        lens = _lens_numbers(other.camera, free.lens) - _lens_numbers(self.camera, free.lens)
        return np.concatenate(
            [
                twist_from_pose(self.mount.inv() @ other.mount),
                twist_from_pose(self.place.inv() @ other.place),
                lens,
                (other.offsets - self.offsets)[free.joints],
                [other.scale - self.scale] * free.scaled,
            ]
        )


def twist_from_pose(T: Pose) -> Array:
    """Return the twist (v, w) with the motion T: the logarithm of the pose.

    v = t - w x t / 2 + c w x (w x t), see `robsim.kernels.formulas.se3.log_coefficient`.

    >>> twist_from_pose(Pose.exp([1, 2, 3, 0.4, 0.5, 0.6])).round(9)
    array([1. , 2. , 3. , 0.4, 0.5, 0.6])
    """
    t, w = T.position, T.rotvec
    w_cross_t = np.cross(w, t)
    c = se3.log_coefficient(float(np.sqrt(w @ w)))
    return np.concatenate([t - 0.5 * w_cross_t + c * np.cross(w, w_cross_t), w])


def _lens_numbers(camera: Camera, which: NDArray[np.int64]) -> Array:
    """Return the parameters of a lens with some indices into `lens_names`."""
    K = camera.K
    return np.concatenate([K[[0, 1, 0, 1], [0, 1, 2, 2]], camera.distortion])[which]


def add_lens_step(camera: Camera, step: Array, which: NDArray[np.int64]) -> Camera:
    """Return a camera with a step added to the lens parameters with some indices."""
    if not len(which):
        return camera
    change = np.zeros(4 + len(camera.distortion))
    change[which] = step
    K = np.array(camera.K)
    K[[0, 1, 0, 1], [0, 1, 2, 2]] += change[:4]
    return replace(camera, K=K, distortion=tuple(np.add(camera.distortion, change[4:]).tolist()))


def predict_pixels(model: CalibrationModel, marks: Array, chain: JointChain, q: Array) -> Array:
    """Return pixels (V, N, 2) of marks (N, 3) at coordinates q (V, nq); NaN behind the camera."""
    return _project_points(_points_in_camera(model, marks, chain, q)[1], model.camera)


def _project_points(X: Array, camera: Camera) -> Array:
    """Return the pixels (V, N, 2) of points X (V, N, 3) in camera axes."""
    pixels, _ = camera.image_of(move_runs_last(X, 2))
    return move_runs_first(pixels)


def _points_in_camera(
    model: CalibrationModel, marks: Array, chain: JointChain, q: Array
) -> tuple[Array, Array]:
    """Return the rotations R_c_o (V, 3, 3), and the marks (V, N, 3) in camera axes."""
    T = (model.mount.inv() @ chain.poses(q + model.offsets) @ model.place).matrix
    return T[:, :3, :3], model.scale * marks @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]


def predict_rates(
    model: CalibrationModel, marks: Array, chain: JointChain, q: Array, free: Unknowns
) -> Array:
    """Return the derivatives (V, N, 2, P) of the pixels by the estimated parameters.

    A mark p of the target is at X = T_c_o p in camera axes. The derivative of X by the twist of the
    mount is [-1, [X]x], by the twist of the target R_c_o [1, -[s p]x], and by its scale s R_c_o p.
    """
    R_c_o, X = _points_in_camera(model, marks, chain, q)
    eye, shape = np.eye(3), (*X.shape, 3)
    parts = [
        np.broadcast_to(-eye, shape),
        cross_matrix(X),
        _target_twist_rates(R_c_o, model.scale * marks),
    ]
    if len(free.joints):
        parts.append(_joint_rates(model, X, chain, q, free.joints))
    if free.scaled:
        parts.append((marks @ R_c_o.swapaxes(1, 2))[..., None])
    rates = _rates_of_pixels(X, np.concatenate(parts, -1), model.camera)
    lens = _rates_by_lens(X, model.camera, free.lens)
    return np.concatenate([rates[..., :12], lens, rates[..., 12:]], -1)


def predict_pose_rates(
    T_c_o: Array, marks: Array, camera: Camera, lens: NDArray[np.int64]
) -> tuple[Array, Array]:
    """Return pixels (V, N, 2) at poses T_c_o (V, 4, 4), and their derivatives (V, N, 2, 6 + n).

    The derivatives are by the twist of the target in its own axes, and by parameters of the lens
    with some indices into `lens_names`.
    """
    R_c_o = T_c_o[:, :3, :3]
    X = marks @ R_c_o.swapaxes(1, 2) + T_c_o[:, None, :3, 3]
    rates = _rates_of_pixels(X, _target_twist_rates(R_c_o, marks), camera)
    return _project_points(X, camera), np.concatenate([rates, _rates_by_lens(X, camera, lens)], -1)


def _target_twist_rates(R_c_o: Array, marks: Array) -> Array:
    """Return the derivatives (V, N, 3, 6) of marks (N, 3) in camera axes by the target's twist."""
    eye = np.broadcast_to(np.eye(3), (len(marks), 3, 3))
    return np.asarray(R_c_o[:, None] @ np.concatenate([eye, -cross_matrix(marks)], -1))


def _rates_of_pixels(X: Array, rates: Array, camera: Camera) -> Array:
    """Return the derivatives (V, N, 2, n) of pixels from derivatives (V, N, 3, n) of points X."""
    x, depth = X[..., :2] / X[..., 2:], X[..., 2, None, None]
    flat = (rates[..., :2, :] - x[..., None] * rates[..., 2:, :]) / depth
    return np.asarray(pixel_rate_matrices(x, camera) @ flat)


def _rates_by_lens(X: Array, camera: Camera, which: NDArray[np.int64]) -> Array:
    """Return the derivatives (V, N, 2, n) of pixels of points X by parameters of the lens."""
    x, count = X[..., :2] / X[..., 2:], len(camera.distortion)
    return lens_rates(x, _project_points(X, camera), camera, count)[..., which]


def _joint_rates(
    model: CalibrationModel, X: Array, chain: JointChain, q: Array, joints: NDArray[np.int64]
) -> Array:
    """Return the derivatives (V, N, 3, n) of points X (V, N, 3) in camera axes by offsets."""
    tree = chain.scene.tree
    alone = tree.alone(np.arange(tree.nv)).tolist()
    columns = np.array([alone.index(joint) for joint in joints.tolist()])
    T = model.mount
    rates = chain.rates(q + model.offsets, T @ X, columns)
    return T.rotation.T @ rates


def lens_rates(x: Array, pixels: Array, camera: Camera, coefficients: int) -> Array:
    """Return the derivatives (..., 2, 4 + n) of pixels by fx, fy, cx, cy and n coefficients.

    The arguments are normalised points x (..., 2) and their pixels (..., 2). The coefficients are
    in the order of `Camera.distortion`.
    """
    (fx, skew, cx), (_, fy, cy), _ = camera.K
    y_bent = (pixels[..., 1] - cy) / fy
    x_bent = (pixels[..., 0] - cx - skew * y_bent) / fx
    zero, one = np.zeros_like(x_bent), np.ones_like(x_bent)
    column = [x_bent, zero, one, zero]
    row = [zero, y_bent, zero, one]
    for dx, dy in camera.model.find_rates(x, camera.coefficients)[:coefficients]:
        column.append(fx * dx + skew * dy)
        row.append(fy * dy)
    return np.stack([np.stack(column, -1), np.stack(row, -1)], -2)
