"""Published inertias of arms of the library, in the frames of their sources.

Each entry has the joints of an arm in the order of the chain: the link in the library, the pose of
the joint in the frame before (xyz in metres, rpy in radians), and mass, centre, rpy of the tensor's
axes and tensor (xx, xy, xz, yy, yz, zz) of the link in the frame of its joint, whose z is the axis.

- ur5e: physical_parameters.yaml of Universal_Robots_ROS2_Description (BSD-3-Clause), the
  numbers of Universal Robots, DH parameters for calculations of kinematics and dynamics.
- panda: franka_description/robots/common/inertial.yaml of franka_ros (Apache-2.0), from C. Gaz,
  M. Cognetti, A. Oliva, P. Robuffo Giordano and A. De Luca, Dynamic identification of the Franka
  Emika Panda robot with retrieval of feasible parameters using penalty-based optimization, IEEE
  RA-L 4(4), 2019.
- lbr_iiwa14: iiwa14_no_collision.urdf of Drake (BSD-3-Clause), from iiwa_stack (BSD-2-Clause).
- kinova_gen3: GEN3_URDF_V12.urdf of ros_kortex (BSD-3-Clause).
"""

from math import pi

H = pi / 2
NO = (0.0, 0.0, 0.0)


def joint(link, xyz, rpy, mass, centre, tensor, axes=NO):
    return {
        "link": link,
        "xyz": xyz,
        "rpy": rpy,
        "mass": mass,
        "centre": centre,
        "axes": axes,
        "tensor": tensor,
    }


UR5E = [
    joint(
        *("shoulder", (0, 0, 0.1625), NO, 3.761, (0, -0.00193, -0.02561)),
        (0.00700210, 0.00000073, -0.00001053, 0.00648091, 0.00049994, 0.00657286),
        (H, 0, 0),
    ),
    joint(
        *("upper_arm", NO, (H, 0, 0), 8.058, (-0.2125, 0, 0.11336)),
        (0.01505885, -0.00005400, 0.00000563, 0.33388086, -0.00000181, 0.33247207),
    ),
    joint(
        *("forearm", (-0.425, 0, 0), NO, 2.846, (-0.2422, 0, 0.0265)),
        (0.00399632, -0.00001365, 0.00137272, 0.07879254, -0.00000660, 0.07848510),
    ),
    joint(
        *("wrist_1", (-0.3922, 0, 0.1333), NO, 1.37, (0, -0.01634, -0.0018)),
        (0.00165491, -0.00000282, -0.00000438, 0.00135962, 0.00010157, 0.00126279),
        (H, 0, 0),
    ),
    joint(
        *("wrist_2", (0, -0.0997, 0), (H, 0, 0), 1.3, (0, 0.01634, -0.0018)),
        (0.00135617, -0.00000274, 0.00000444, 0.00127827, -0.00005048, 0.00096614),
        (-H, 0, 0),
    ),
    joint(
        *("flange", (0, 0.0996, 0), (H, pi, pi), 0.365, (0, 0, -0.001159)),
        (0.00018694, 0.00000006, -0.00000017, 0.00018908, -0.00000092, 0.00025756),
    ),
]
PANDA = [
    joint(
        *("link1", (0, 0, 0.333), NO, 4.970684, (0.003875, 0.002081, -0.04762)),
        (0.70337, -0.00013900, 0.0067720, 0.70661, 0.019169, 0.0091170),
    ),
    joint(
        *("link2", NO, (-H, 0, 0), 0.646926, (-0.003141, -0.02872, 0.003495)),
        (0.0079620, -3.9250e-3, 1.0254e-02, 2.8110e-02, 7.0400e-04, 2.5995e-02),
    ),
    joint(
        *("link3", (0, -0.316, 0), (H, 0, 0), 3.228604, (2.7518e-02, 3.9252e-02, -6.6502e-02)),
        (3.7242e-02, -4.7610e-03, -1.1396e-02, 3.6155e-02, -1.2805e-02, 1.0830e-02),
    ),
    joint(
        *("link4", (0.0825, 0, 0), (H, 0, 0), 3.587895, (-5.317e-02, 1.04419e-01, 2.7454e-02)),
        (2.5853e-02, 7.7960e-03, -1.3320e-03, 1.9552e-02, 8.6410e-03, 2.8323e-02),
    ),
    joint(
        *("link5", (-0.0825, 0.384, 0), (-H, 0, 0)),
        *(1.225946, (-1.1953e-02, 4.1065e-02, -3.8437e-02)),
        (3.5549e-02, -2.1170e-03, -4.0370e-03, 2.9474e-02, 2.2900e-04, 8.6270e-03),
    ),
    joint(
        *("link6", NO, (H, 0, 0), 1.666555, (6.0149e-02, -1.4117e-02, -1.0517e-02)),
        (1.9640e-03, 1.0900e-04, -1.1580e-03, 4.3540e-03, 3.4100e-04, 5.4330e-03),
    ),
    joint(
        *("link7", (0.088, 0, 0), (H, 0, 0), 7.35522e-01, (1.0517e-02, -4.252e-03, 6.1597e-02)),
        (1.2516e-02, -4.2800e-04, -1.1960e-03, 1.0027e-02, -7.4100e-04, 4.8150e-03),
    ),
]


def diagonal(xx, yy, zz):
    return xx, 0.0, 0.0, yy, 0.0, zz


IIWA14 = [
    joint(*("link1", (0, 0, 0.1575), NO, 5.76, (0, -0.03, 0.12)), diagonal(0.033, 0.0333, 0.0123)),
    joint(
        *("link2", (0, 0, 0.2025), (H, 0, pi), 6.35, (0.0003, 0.059, 0.042)),
        diagonal(0.0305, 0.0304, 0.011),
    ),
    joint(
        *("link3", (0, 0.2045, 0), (H, 0, pi), 3.5, (0, 0.03, 0.13)),
        diagonal(0.025, 0.0238, 0.0076),
    ),
    joint(
        *("link4", (0, 0, 0.2155), (H, 0, 0), 3.5, (0, 0.067, 0.034)),
        diagonal(0.017, 0.0164, 0.006),
    ),
    joint(
        *("link5", (0, 0.1845, 0), (-H, pi, 0), 3.5, (0.0001, 0.021, 0.076)),
        diagonal(0.01, 0.0087, 0.00449),
    ),
    joint(
        *("link6", (0, 0, 0.2155), (H, 0, 0), 1.8, (0, 0.0006, 0.0004)),
        diagonal(0.0049, 0.0047, 0.0036),
    ),
    joint(
        *("flange", (0, 0.081, 0), (-H, pi, 0), 1.2, (0, 0, 0.02)), diagonal(0.001, 0.001, 0.001)
    ),
]
GEN3 = [
    joint(
        *("shoulder", (0, 0, 0.15643), (pi, 0, 0), 1.3773, (-2.3e-05, -0.010364, -0.07336)),
        (0.00457, 1e-06, 2e-06, 0.004831, 0.000448, 0.001409),
    ),
    joint(
        *("half_arm_1", (0, 0.005375, -0.12838), (H, 0, 0)),
        *(1.1636, (-4.4e-05, -0.09958, -0.013278)),
        (0.011088, 5e-06, 0, 0.001072, -0.000691, 0.011255),
    ),
    joint(
        *("half_arm_2", (0, -0.21038, -0.006375), (-H, 0, 0)),
        *(1.1636, (-4.4e-05, -0.006641, -0.117892)),
        (0.010932, 0, -7e-06, 0.011127, 0.000606, 0.001043),
    ),
    joint(
        *("forearm", (0, 0.006375, -0.21038), (H, 0, 0)),
        *(0.9302, (-1.8e-05, -0.075478, -0.015006)),
        (0.008147, -1e-06, 0, 0.000631, -0.0005, 0.008316),
    ),
    joint(
        *("wrist_1", (0, -0.20843, -0.006375), (-H, 0, 0)),
        *(0.6781, (1e-06, -0.009432, -0.063883)),
        (0.001596, 0, 0, 0.001607, 0.000256, 0.000399),
    ),
    joint(
        *("wrist_2", (0, 0.00017505, -0.10593), (H, 0, 0)),
        *(0.6781, (1e-06, -0.045483, -0.00965)),
        (0.001641, 0, 0, 0.00041, -0.000278, 0.001641),
    ),
    joint(
        *("flange", (0, -0.10593, -0.00017505), (-H, 0, 0)),
        *(0.5006, (-0.000281, -0.011402, -0.029798)),
        (0.000587, 3e-06, 3e-06, 0.000369, 0.000118, 0.000609),
    ),
]
PUBLISHED = {"ur5e": UR5E, "panda": PANDA, "lbr_iiwa14": IIWA14, "kinova_gen3": GEN3}
