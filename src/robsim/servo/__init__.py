"""Laws, goals and tasks: how features become joint velocities."""

from robsim.servo.goal import Computed as Computed
from robsim.servo.goal import Shown as Shown
from robsim.servo.ibvs import IBVS as IBVS
from robsim.servo.inverse import Damped as Damped
from robsim.servo.inverse import Truncated as Truncated
from robsim.servo.law import CameraLaw as CameraLaw
from robsim.servo.law import JointLaw as JointLaw
from robsim.servo.law import Law as Law
from robsim.servo.law import State as State
