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
    """The image of a sphere about mark 0, s = (X, Y, Z) / radius of its centre in camera axes.

    The outline of a sphere gives s: its direction is that of the cone of sight, and its length
    1 / sin of the angle at which the outline is seen. Here s is computed from the image and depth
    of the centre instead. L = [-I / radius, [s]x] has rank 3: every turn about the sphere looks the
    same. Fomena and Chaumette 2009, Improvements on visual servoing from
    spherical targets using a spherical projection model, IEEE T-RO 25(4).

    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> centre = [[0.1, -0.2]]
    >>> seen = Observation.of(centre, [2.0], Camera(np.eye(3)))
    >>> Sphere(radius=0.5).measure(seen)
    array([[ 0.4, -0.8,  4. ]])
    """

    radius: Annotated[float, Length(above=0), "Radius of the sphere."] = 0.1
    tolerance: Tolerance = 1e-5
    unit: str = "1"
    least_marks: ClassVar[int] = 1
    measures_depth: ClassVar[bool] = True

    def stages(self, seen: ObservationRows) -> FeatureRows:
        """Add the stages of s and L to a program, and return their rows."""
        given = {"point": seen.points[:1], "depth": seen.depth[:1]}
        radius = seen.program.constant(self.radius)
        return seen.computed(kernels.sphere_stage, 3, **given, radius=radius)
