"""Links, joints and joint kinds of a robot."""

from robsim.robot.dh_row import DHRow as DHRow
from robsim.robot.joint import Ackermann as Ackermann
from robsim.robot.joint import Chord as Chord
from robsim.robot.joint import Joint as Joint
from robsim.robot.joint import JointKind as JointKind
from robsim.robot.joint import Mimic as Mimic
from robsim.robot.joint import Rolling as Rolling
from robsim.robot.joint import Steering as Steering
from robsim.robot.link import Link as Link
