"""What a camera measures and a controller regulates."""

from robsim.features.depth import LogDepth as LogDepth
from robsim.features.feature import Feature as Feature
from robsim.features.feature import Observation as Observation
from robsim.features.lines import Lines as Lines
from robsim.features.lines import VanishingPoint as VanishingPoint
from robsim.features.points import PixelPoints as PixelPoints
from robsim.features.points import Points as Points
from robsim.features.points_3d import Points3D as Points3D
from robsim.features.polar import Polar as Polar
from robsim.features.segments import Segments as Segments
from robsim.features.spherical import Spherical as Spherical

FEATURES = {
    "points": Points,
    "pixels": PixelPoints,
    "polar": Polar,
    "spherical": Spherical,
    "log_depth": LogDepth,
    "points_3d": Points3D,
    "segments": Segments,
    "lines": Lines,
    "vanishing_point": VanishingPoint,
}
