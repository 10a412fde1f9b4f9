"""Laws, goals and tasks: how features become joint velocities."""

from robsim.servo.laws.broyden import Broyden as Broyden
from robsim.servo.tasks.conditions import ErrorBelow as ErrorBelow
from robsim.servo.tasks.conditions import NearBorder as NearBorder
from robsim.servo.laws.depth_filter import DepthFilter as DepthFilter
from robsim.servo.tasks.docking import Docking as Docking
from robsim.servo.laws.feed_forward import Estimated as Estimated
from robsim.servo.tasks.follow_joints import FollowJoints as FollowJoints
from robsim.servo.tasks.follow_path import FollowPath as FollowPath
from robsim.servo.laws.gain import Adaptive as Adaptive
from robsim.servo.goals.goal import Computed as Computed
from robsim.servo.goals.goal import Given as Given
from robsim.servo.goals.goal import Shown as Shown
from robsim.servo.laws.inverse import Damped as Damped
from robsim.servo.laws.inverse import Transposed as Transposed
from robsim.servo.laws.inverse import Truncated as Truncated
from robsim.servo.laws.law import CameraLaw as CameraLaw
from robsim.servo.laws.law import JointLaw as JointLaw
from robsim.servo.laws.law import Law as Law
from robsim.servo.laws.law import State as State
from robsim.servo.shaping.limit import SpeedLimit as SpeedLimit
from robsim.servo.part import Part as Part
from robsim.servo.laws.partitioned import PartitionedLaw as PartitionedLaw
from robsim.servo.tasks.placing import Placing as Placing
from robsim.servo.tasks.priorities import Priorities as Priorities
from robsim.servo.shaping.redundancy import AvoidLimits as AvoidLimits
from robsim.servo.shaping.redundancy import Posture as Posture
from robsim.servo.tasks.schemes import IBVS as IBVS
from robsim.servo.tasks.schemes import PBVS as PBVS
from robsim.servo.tasks.schemes import SCHEMES as SCHEMES
from robsim.servo.tasks.schemes import Hybrid as Hybrid
from robsim.servo.tasks.schemes import Partitioned as Partitioned
from robsim.servo.shaping.shaping import Large as Large
from robsim.servo.tasks.switch import Switch as Switch
from robsim.servo.tasks.task import ServoTask as ServoTask
from robsim.servo.tasks.task import Task as Task
from robsim.servo.tasks.together import Together as Together

FOLLOWERS: dict[str, type[FollowJoints] | type[FollowPath]] = {
    each.kind: each for each in (FollowJoints, FollowPath)
}
SEVERAL = {each.kind: each for each in (Priorities, Switch, Together)}
