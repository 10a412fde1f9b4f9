"""What a camera measures and a controller regulates."""

from robsim.features.feature import Feature as Feature
from robsim.features.feature import Observation as Observation
from robsim.features.points import PixelPoints as PixelPoints
from robsim.features.points import Points as Points

FEATURES = {"points": Points, "pixels": PixelPoints}
