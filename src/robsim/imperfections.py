"""Imperfections of sensors and actuators: noise, delays, outliers, occlusions, lag."""

from robsim.world.imperfections.encoder import Encoder as Encoder
from robsim.world.imperfections.image_effect import ImageEffect as ImageEffect
from robsim.world.imperfections.image_loss import DroppedImages as DroppedImages
from robsim.world.imperfections.joint_effect import JointEffect as JointEffect
from robsim.world.imperfections.lag import Lag as Lag
from robsim.world.imperfections.latency import Latency as Latency
from robsim.world.imperfections.noise import PixelNoise as PixelNoise
from robsim.world.imperfections.occlusion import Occlusion as Occlusion
from robsim.world.imperfections.outliers import Outliers as Outliers
from robsim.world.imperfections.period import CameraPeriod as CameraPeriod
from robsim.world.imperfections.quantisation import Quantisation as Quantisation
from robsim.world.imperfections.rate_limits import AccelerationLimit as AccelerationLimit
from robsim.world.imperfections.rate_limits import VelocityLimit as VelocityLimit
