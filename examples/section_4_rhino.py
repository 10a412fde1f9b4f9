"""Section 4 of the chapter: the Rhino XR-4 from its DH table, at home and moved (figs 9, 10)."""

import numpy as np

import robsim as rs
from robsim.units import cm, deg

rows = [  # theta, d, a, alpha
    [0, 26.04 * cm, 0, -90 * deg],
    [0, 0, 22.86 * cm, 0],
    [0, 0, 22.86 * cm, 0],
    [0, 0, 0.95 * cm, -90 * deg],
    [0, 16.83 * cm, 0, 0],
]
home = np.array([0, -90, 90, 0, -90]) * deg
by_hand = rs.Robot.from_dh(rows, "standard", "RRRRR", home=home, name="by_hand")
rhino = rs.robots.rhino_xr4()  # the library robot, with limits and blocks to draw

for name, q in [("home", home), ("moved", home + np.array([40, 10, -20, 10, 30]) * deg)]:
    T = by_hand.fk(q)
    assert np.allclose(T, rhino.fk(q))
    print(f"{name}: tool tip at {np.round(T[:3, 3] / cm, 2)} cm")
    rs.plot.scene(rs.Scene([rhino]), q).savefig(f"rhino_{name}.png", dpi=240)
print("Jacobian at home, rows (v, omega) in base axes:")
print(by_hand.jacobian(home).round(4))
