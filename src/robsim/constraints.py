"""Constraints on the command of a law, for `robsim.laws.ConstrainedLaw`.

Joints: `JointLimits`, `JointSpeeds`, `JointAccelerations`. View: `FieldOfView`, `MarkDepth`,
`LineOfSight`. Space: `HalfSpace`, `WorkspaceBox`, `Clearance`. Your own: an object with `names` and
`rows(state)`, see `UserConstraint`.
"""

from robsim.servo.constraints.clearance import Clearance as Clearance
from robsim.servo.constraints.field_of_view import FieldOfView as FieldOfView
from robsim.servo.constraints.half_space import HalfSpace as HalfSpace
from robsim.servo.constraints.joint_accelerations import JointAccelerations as JointAccelerations
from robsim.servo.constraints.joint_limits import JointLimits as JointLimits
from robsim.servo.constraints.joint_speeds import JointSpeeds as JointSpeeds
from robsim.servo.constraints.line_of_sight import LineOfSight as LineOfSight
from robsim.servo.constraints.mark_depth import MarkDepth as MarkDepth
from robsim.servo.constraints.user_constraint import ConstraintState as ConstraintState
from robsim.servo.constraints.user_constraint import UserConstraint as UserConstraint
from robsim.servo.constraints.workspace_box import WorkspaceBox as WorkspaceBox
