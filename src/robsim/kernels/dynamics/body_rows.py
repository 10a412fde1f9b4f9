"""Rows of a body in the algorithms of rigid-body dynamics.

All quantities of a body are in the axes of the body, at its origin, which lies on the axis of its
joint. Accelerations are classical: they are derivatives of velocities, not the spatial
accelerations of Featherstone 2008, section 2.11. Gravity is an acceleration of the carriers in the
opposite direction (Luh, Walker and Paul 1980).
"""

REVOLUTE, PRISMATIC, FLOATING = 1, 2, 3  # kinds of the joint of a body

ROTATION, POSITION = 0, 9  # pose of the body in its parent
TURNING, TURNING_RATE, ACCELERATION = 12, 15, 18  # angular velocity and its derivative
FORCE, MOMENT = 21, 24  # on the body by its joint, at its origin; or by velocities (bias)
# articulated inertia: moments I (symmetric), coupling B, masses M (symmetric), so that
# moment = I turning_rate + B acceleration and force = B' turning_rate + M acceleration
MOMENTS, COUPLING, MASSES = 27, 33, 42
AXIS_MOMENT, AXIS_FORCE = 48, 51  # articulated inertia times the axis of the joint
COMPLIANCE, EXCESS = 54, 55  # inverse inertia at the joint, and its force beyond the bias
RATE_BIAS, ACCELERATION_BIAS = 56, 59  # accelerations by velocities
ROWS = 62

# accelerations of a joint whose articulated inertia is not positive: no robot reaches them
IMPOSSIBLE = 1e305

MASS, FIRST_MOMENT, SECOND_MOMENT = 0, 1, 4  # rows of the inertia of a body, about its origin
