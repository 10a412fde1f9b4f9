"""The dynamics of random trees against Pinocchio (generate_dynamics.py), and a printed robot."""

import json
from pathlib import Path

import numpy as np
import pytest
from rigid_trees import draw_motion, make_tree

import robsim as rs

STORED = json.loads((Path(__file__).parent / "dynamics_pinocchio.json").read_text())


@pytest.mark.parametrize("case", STORED["trees"], ids=lambda case: str(case["tree"]["seed"]))
def test_random_trees_have_the_dynamics_of_pinocchio(case):
    robot = make_tree(**case["tree"])
    (q,), (v,), (a,), (tau,) = draw_motion(robot, case["tree"]["seed"], 1)
    found = {
        "inverse_dynamics": robot.inverse_dynamics(q, v, a),
        "gravity": robot.gravity(q),
        "mass_matrix": robot.mass_matrix(q),
        "forward_dynamics": robot.forward_dynamics(q, v, tau),
        "kinetic_energy": robot.kinetic_energy(q, v),
        "potential_energy": robot.potential_energy(q),
    }
    for name, value in found.items():
        expected = np.array(case[name])
        np.testing.assert_allclose(value, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_the_puma_has_its_printed_load_and_inertia():
    """Corke, Robotics, Vision and Control, 2011, section 9.2: gravload(qn) and inertia(qn)."""
    puma = rs.robots.puma560()
    q = [0.0, np.pi / 4, np.pi, 0.0, np.pi / 4, 0.0]
    load, inertia = puma.gravity(q), puma.mass_matrix(q)
    assert load[1:].round(4).tolist() == [31.6399, 6.0351, 0.0, 0.0283, 0.0]
    diagonal = [3.6594, 4.4137, 0.9378, 0.1925, 0.1713, 0.1941]
    assert inertia.diagonal().round(4).tolist() == diagonal
    assert inertia[0, 1].round(4) == -0.4044
