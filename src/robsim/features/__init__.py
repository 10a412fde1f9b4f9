"""What a camera measures and a controller regulates."""

from robsim.features.ellipse import Ellipse as Ellipse
from robsim.features.feature import Feature as Feature
from robsim.features.feature import Observation as Observation
from robsim.features.moments import DecoupledMoments as DecoupledMoments
from robsim.features.moments import PointMoments as PointMoments
from robsim.features.moments import RegionMoments as RegionMoments
from robsim.features.points import PixelPoints as PixelPoints
from robsim.features.points import Points as Points
from robsim.features.sphere import Sphere as Sphere

FEATURES = {
    "points": Points,
    "pixels": PixelPoints,
    RegionMoments.name: RegionMoments,
    PointMoments.name: PointMoments,
    DecoupledMoments.name: DecoupledMoments,
    Ellipse.name: Ellipse,
    Sphere.name: Sphere,
}
