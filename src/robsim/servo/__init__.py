"""Laws, goals and tasks: how features become joint velocities."""

from robsim.servo.feature_block import FeatureBlock as FeatureBlock
from robsim.servo.goals.goal import GoalFeatures as GoalFeatures
from robsim.servo.goals.goal import GoalPose as GoalPose
from robsim.servo.goals.goal import TaughtGoal as TaughtGoal
from robsim.servo.laws.broyden import Broyden as Broyden
from robsim.servo.laws.depth_filter import DepthFilter as DepthFilter
from robsim.servo.laws.feed_forward import EstimatedMotion as EstimatedMotion
from robsim.servo.laws.gain import AdaptiveGain as AdaptiveGain
from robsim.servo.laws.inverse import DampedInverse as DampedInverse
from robsim.servo.laws.inverse import JacobianTranspose as JacobianTranspose
from robsim.servo.laws.inverse import PseudoInverse as PseudoInverse
from robsim.servo.laws.law import CameraLaw as CameraLaw
from robsim.servo.laws.law import ControlState as ControlState
from robsim.servo.laws.law import JointLaw as JointLaw
from robsim.servo.laws.law import Law as Law
from robsim.servo.laws.partitioned import PartitionedLaw as PartitionedLaw
from robsim.servo.shaping.limit import SpeedLimit as SpeedLimit
from robsim.servo.shaping.redundancy import AvoidLimits as AvoidLimits
from robsim.servo.shaping.redundancy import Posture as Posture
from robsim.servo.shaping.shaping import LargeProjection as LargeProjection
from robsim.servo.tasks.conditions import ErrorBelow as ErrorBelow
from robsim.servo.tasks.conditions import NearBorder as NearBorder
from robsim.servo.tasks.docking import Docking as Docking
from robsim.servo.tasks.follow_joints import FollowJoints as FollowJoints
from robsim.servo.tasks.follow_path import FollowPath as FollowPath
from robsim.servo.tasks.parallel import Parallel as Parallel
from robsim.servo.tasks.placing import Placing as Placing
from robsim.servo.tasks.priorities import Priorities as Priorities
from robsim.servo.tasks.schemes import IBVS as IBVS
from robsim.servo.tasks.schemes import PBVS as PBVS
from robsim.servo.tasks.schemes import SCHEMES as SCHEMES
from robsim.servo.tasks.schemes import Hybrid as Hybrid
from robsim.servo.tasks.schemes import Partitioned as Partitioned
from robsim.servo.tasks.switch import Switch as Switch
from robsim.servo.tasks.task import ServoTask as ServoTask
from robsim.servo.tasks.task import Task as Task

FOLLOWERS: dict[str, type[FollowJoints] | type[FollowPath]] = {
    each.kind: each for each in (FollowJoints, FollowPath)
}
SEVERAL = {each.kind: each for each in (Priorities, Switch, Parallel)}
