"""The view of one object by one camera on the tree: all that follows from q at an instant."""

from typing import Any, NamedTuple

from robsim.kernels import tree


class Eye(NamedTuple):
    """The constants of a camera and its target."""

    body: int  # that carries the camera
    hand_eye: Any  # pose of the camera on it
    target: int  # body that carries the target
    offset: Any  # pose of the target on it
    marks: Any  # (N, 3) in axes of the target
    K: Any
    lens: Any
    border: Any
    valid_radius: float
    moves: bool  # whether a joint carries the camera


class Projection(NamedTuple):
    """The poses of a camera and its target, and the image of the marks, at one instant."""

    bodies: tree.Bodies
    T_w_c: Any  # (3, 4, B)
    T_w_o: Any  # (3, 4, B)
    depth: Any  # (N, B)
    pixels: Any  # (N, 2, B), NaN behind the camera
    visibility: Any  # (N, B)
