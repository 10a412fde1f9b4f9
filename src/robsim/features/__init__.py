"""What a camera measures and a controller regulates."""

from robsim.features.feature import Feature as Feature
from robsim.features.feature import Observation as Observation
from robsim.features.points import PixelPoints as PixelPoints
from robsim.features.points import Points as Points
from robsim.features.pose import ThetaU as ThetaU
from robsim.features.pose import Translation as Translation
from robsim.features.stereo import StereoPoints as StereoPoints

FEATURES = {
    "points": Points,
    "pixels": PixelPoints,
    "theta_u": ThetaU,
    "translation": Translation,
    "stereo_points": StereoPoints,
}
