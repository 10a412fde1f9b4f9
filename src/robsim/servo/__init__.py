"""Laws, goals and tasks: how features become joint velocities."""

from robsim.servo.broyden import Broyden as Broyden
from robsim.servo.conditions import ErrorBelow as ErrorBelow
from robsim.servo.conditions import NearBorder as NearBorder
from robsim.servo.depth import DepthFilter as DepthFilter
from robsim.servo.docking import Docking as Docking
from robsim.servo.feed_forward import Estimated as Estimated
from robsim.servo.follow_joints import FollowJoints as FollowJoints
from robsim.servo.follow_path import FollowPath as FollowPath
from robsim.servo.gain import Adaptive as Adaptive
from robsim.servo.goal import Computed as Computed
from robsim.servo.goal import Given as Given
from robsim.servo.goal import Shown as Shown
from robsim.servo.inverse import Damped as Damped
from robsim.servo.inverse import Transposed as Transposed
from robsim.servo.inverse import Truncated as Truncated
from robsim.servo.law import CameraLaw as CameraLaw
from robsim.servo.law import JointLaw as JointLaw
from robsim.servo.law import Law as Law
from robsim.servo.law import State as State
from robsim.servo.limit import SpeedLimit as SpeedLimit
from robsim.servo.part import Part as Part
from robsim.servo.partitioned import PartitionedLaw as PartitionedLaw
from robsim.servo.placing import Placing as Placing
from robsim.servo.priorities import Priorities as Priorities
from robsim.servo.redundancy import AvoidLimits as AvoidLimits
from robsim.servo.redundancy import Posture as Posture
from robsim.servo.schemes import IBVS as IBVS
from robsim.servo.schemes import PBVS as PBVS
from robsim.servo.schemes import SCHEMES as SCHEMES
from robsim.servo.schemes import Hybrid as Hybrid
from robsim.servo.schemes import Partitioned as Partitioned
from robsim.servo.shaping import Large as Large
from robsim.servo.switch import Switch as Switch
from robsim.servo.task import ServoTask as ServoTask
from robsim.servo.task import Task as Task
from robsim.servo.together import Together as Together

FOLLOWERS: dict[str, type[FollowJoints] | type[FollowPath]] = {
    each.kind: each for each in (FollowJoints, FollowPath)
}
SEVERAL = {each.kind: each for each in (Priorities, Switch, Together)}
