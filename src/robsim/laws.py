"""Control laws of a servo task, and the parts from which they are built."""

from robsim.servo.laws.broyden_rule import Broyden as Broyden
from robsim.servo.laws.constrained_law import ConstrainedLaw as ConstrainedLaw
from robsim.servo.laws.control_state import ControlState as ControlState
from robsim.servo.laws.depth_filter import DepthFilter as DepthFilter
from robsim.servo.laws.feed_forward import EstimatedMotion as EstimatedMotion
from robsim.servo.laws.gain import AdaptiveGain as AdaptiveGain
from robsim.servo.laws.inverse import DampedInverse as DampedInverse
from robsim.servo.laws.inverse import JacobianTranspose as JacobianTranspose
from robsim.servo.laws.inverse import PseudoInverse as PseudoInverse
from robsim.servo.laws.law import CameraLaw as CameraLaw
from robsim.servo.laws.law import JointLaw as JointLaw
from robsim.servo.laws.partitioned_law import PartitionedLaw as PartitionedLaw
from robsim.servo.laws.rollout_law import RolloutLaw as RolloutLaw
from robsim.servo.laws.torque_law import TorqueLaw as TorqueLaw
from robsim.servo.shaping.command_shaper import LargeProjection as LargeProjection
from robsim.servo.shaping.redundancy import AvoidLimits as AvoidLimits
from robsim.servo.shaping.redundancy import Posture as Posture
from robsim.servo.shaping.speed_limit import SpeedLimit as SpeedLimit
