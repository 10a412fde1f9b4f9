"""The projection of one object into one camera at an instant."""

from typing import Any, NamedTuple

from robsim.kernels.formulas import body_arrays


class Projection(NamedTuple):
    """The poses of a camera and its target, and the image of the target's marks, at one instant."""

    bodies: body_arrays.Bodies
    T_w_c: Any  # (3, 4, B)
    T_w_o: Any  # (3, 4, B)
    depth: Any  # (N, B)
    pixels: Any  # (N, 2, B), NaN behind the camera
    visibility: Any  # (N, B)
