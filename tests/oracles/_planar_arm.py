"""A planar arm of two joints with a fixed camera, in closed form.

The equations of motion are those of Kelly, Santibanez and Loria 2005, "Control of Robot
Manipulators in Joint Space", section 5.3; the masses and lengths are near those of its arm Pelican.
The arm moves in the vertical plane of x and z; q = 0 hangs down.
"""

import numpy as np

L1, L2, C1, C2 = 0.26, 0.26, 0.0983, 0.0229  # lengths, and distances of the centres of mass, m
M1, M2, I1, I2 = 6.5225, 2.0458, 0.1213, 0.0116  # kg, and kg m^2 about the centres of mass
GRAVITY = 9.81
CENTRE, DISTANCE = np.array([0.15, -0.2]), 1.2  # of the camera: x and z, and from the plane
DAMPING = np.array([6.0, 0.8])  # Kv, N m s
GOAL = np.array([0.5, 0.9])


def inertia(q):
    """Mass matrix."""
    both = M2 * L1 * C2 * np.cos(q[1])
    m22 = M2 * C2**2 + I2
    m11 = M1 * C1**2 + M2 * L1**2 + I1 + m22 + 2.0 * both
    return np.array([[m11, m22 + both], [m22 + both, m22]])


def coriolis(q, v):
    """Coriolis and centrifugal torques."""
    h = M2 * L1 * C2 * np.sin(q[1])
    return np.array([-h * v[1] * (2.0 * v[0] + v[1]), h * v[0] ** 2])


def weight(q):
    """Torques that hold the arm against gravity."""
    second = M2 * C2 * GRAVITY * np.sin(q[0] + q[1])
    return np.array([(M1 * C1 + M2 * L1) * GRAVITY * np.sin(q[0]) + second, second])


def image(q, roll):
    """Normalised image coordinates of the tip and their Jacobian, for a rolled camera."""
    a, b = q[0], q[0] + q[1]
    tip = np.array([L1 * np.sin(a) + L2 * np.sin(b), -L1 * np.cos(a) - L2 * np.cos(b)])
    jacobian = np.array(
        [
            [L1 * np.cos(a) + L2 * np.cos(b), L2 * np.cos(b)],
            [L1 * np.sin(a) + L2 * np.sin(b), L2 * np.sin(b)],
        ]
    )
    c, s = np.cos(roll), np.sin(roll)
    # camera x is world x and camera y is minus world z before the roll
    to_image = np.array([[c, s], [-s, c]]) @ np.diag([1.0, -1.0]) / DISTANCE
    return to_image @ (tip - CENTRE), to_image @ jacobian


def believed_jacobian(q, roll, roll_error):
    """L J of a camera with a wrong roll: L at the measured point, J at the believed one.

    Both joints turn the arm about minus the optical axis, at a rate of 1. The measured point is
    displaced by d from the believed one, and so moves by -1 x d beside its motion.
    """
    measured, _ = image(q, roll)
    believed, jacobian = image(q, roll + roll_error)
    d = measured - believed
    return jacobian + np.array([[d[1]], [-d[0]]])
