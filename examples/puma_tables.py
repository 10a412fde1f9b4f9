"""Print the published dynamics of the Puma 560: weight and inertia in its nominal configuration.

The model is Armstrong, Khatib and Burdick 1986; the printed numbers are in Corke, Robotics, Vision
and Control, section 9.2.
"""

import numpy as np

import robsim as rs

NOMINAL = np.array([0, 45, 180, 0, 45, 0]) * rs.units.deg
LOAD = [0, 31.64, 6.035, 0, 0.0283, 0]  # N m
DIAGONAL = [3.659, 4.414, 0.938, 0.1925, 0.1713, 0.1941]  # kg m^2

arm = rs.robots.puma560()
load = arm.gravity(NOMINAL)
inertia = arm.mass_matrix(NOMINAL)

print(f"{'joint':12} {'weight (N m)':>13} {'printed':>8} {'inertia (kg m^2)':>17} {'printed':>8}")
rows = zip(arm.coordinate_names, load + 0.0, LOAD, np.diag(inertia), DIAGONAL, strict=True)
for joint, weight, printed, moment, diagonal in rows:
    print(f"{joint:12} {weight:13.4f} {printed:8g} {moment:17.4f} {diagonal:8g}")
print("mass matrix (kg m^2):")
print(np.array2string(inertia + 0.0, precision=4, suppress_small=True))
assert np.allclose(load, LOAD, atol=5e-4) and np.allclose(np.diag(inertia), DIAGONAL, atol=5e-4)
