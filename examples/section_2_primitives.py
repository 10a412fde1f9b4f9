"""Sections 2 and 3 of the chapter: use its ten functions, in centimetres."""

import matplotlib.pyplot as plt
import numpy as np

from robsim.classic import (
    init_block,
    init_cam,
    init_circ,
    move_block,
    move_cam,
    move_circ,
    plot_block,
    plot_cam,
    plot_circ,
    point_view,
)

upright, down = np.eye(3), np.diag([1.0, -1.0, -1.0])
block = move_block(init_block(10, 6, 4, "b"), upright, [0, 0, 2])
wheel = move_circ(init_circ(3, 1.5, 32, "r"), upright, [12, 0, 0.75])
camera = move_cam(init_cam(8, 5, 4, 0.8, 1e-3, 1e-3, 0, 240, 320, "k"), down, [0, 0, 30])

plot_block(block), plot_circ(wheel), plot_cam(camera)
plt.gcf().savefig("primitives.png", dpi=240)

T_c = camera.pose.matrix  # pose of the camera in the base frame
for corner in block.vertices[4:]:
    row, column = point_view(corner, camera.Ki, T_c)
    print(f"corner {corner} cm is at row {row:.1f}, column {column:.1f}")
