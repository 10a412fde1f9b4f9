"""The visual features that a controller regulates."""

from robsim.features.depth import LogDepth as LogDepth
from robsim.features.ellipse import Ellipse as Ellipse
from robsim.features.feature import FEATURES as FEATURES
from robsim.features.feature import Feature as Feature
from robsim.features.feature import Observation as Observation
from robsim.features.lines import Lines as Lines
from robsim.features.lines import VanishingPoint as VanishingPoint
from robsim.features.moments import DecoupledMoments as DecoupledMoments
from robsim.features.moments import PointMoments as PointMoments
from robsim.features.moments import RegionMoments as RegionMoments
from robsim.features.points import PixelPoints as PixelPoints
from robsim.features.points import Points as Points
from robsim.features.points_3d import Points3D as Points3D
from robsim.features.polar import Polar as Polar
from robsim.features.pose import ThetaU as ThetaU
from robsim.features.pose import Translation as Translation
from robsim.features.segments import Segments as Segments
from robsim.features.sphere import Sphere as Sphere
from robsim.features.spherical import Spherical as Spherical
from robsim.features.stereo import StereoPoints as StereoPoints
