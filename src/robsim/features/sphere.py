"""The image of a sphere of known radius."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.declare import DeclaredValue, Length, register
from robsim.features.compiled_feature import CompiledFeature
from robsim.features.feature import Tolerance
from robsim.features.feature_rows import FeatureRows, ObservationRows
from robsim.kernels.features import conics as kernels


@register("feature", "sphere")
@dataclass(frozen=True)
class Sphere(CompiledFeature, DeclaredValue):
    """Image of a sphere centred at mark 0, s = (X, Y, Z)/radius of its centre in camera axes.

    The direction of s is the axis of the cone that touches the sphere, and |s| = 1/sin(angle) for
    the half angle of the cone. RobSim computes s from the image and the depth of the centre. The
    interaction matrix

        L = [-I/radius, [s]x]

    has rank 3 (Fomena and Chaumette 2009, "Improvements on visual servoing from spherical targets
    using a spherical projection model", IEEE T-RO 25(4)): every rotation about the centre leaves
    the image unchanged. The task fixes three motions of the camera; use the other three for a
    `secondary` motion or another feature. With a goal of numbers, a wrong radius scales the final
    distance to the sphere.

    Raises
    ------
    InputError
        By `simulate`, if the depth of the task is neither "true" nor a `DepthFilter`.

    Examples
    --------
    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> centre = [[0.1, -0.2]]
    >>> seen = Observation.of(centre, [2.0], Camera(np.eye(3)))
    >>> Sphere(radius=0.5).measure(seen)
    array([[ 0.4, -0.8,  4. ]])
    """

    radius: Annotated[float, Length(above=0), "Radius of the sphere, in metres."] = 0.1
    tolerance: Tolerance = 1e-5
    unit: str = "1"
    least_marks: ClassVar[int] = 1
    measures_depth: ClassVar[bool] = True

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        centre = {"point": seen.points[:1], "depth": seen.depth[:1]}
        radius = seen.program.constant(self.radius)
        return seen.computed(kernels.sphere_stage, 3, **centre, radius=radius)
