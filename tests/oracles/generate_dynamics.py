"""Oracle: the dynamics of random trees of rigid bodies, by Pinocchio.

Program: Pinocchio (`pip install pin`); the version used is in "made_by".
Run:     PYTHONPATH=tests python tests/oracles/generate_dynamics.py
Writes:  dynamics_pinocchio.json, always the same numbers.

The robots and their motions follow from seeds (tests/rigid_trees.py). Their joints are revolute and
prismatic about and along z, between random poses; some trees stand on a floating joint. Forces and
accelerations are in the order of the velocities of the robot; those of a floating joint are in axes
of the moved frame, first linear and then angular, as Pinocchio's.
"""

import pinocchio as pin
from _store import store
from pinocchio_models import PinocchioDynamics
from rigid_trees import draw_motion, make_tree

CASES = [
    *({"seed": seed, "joints": joints} for seed, joints in enumerate((1, 2, 3, 5, 7, 9))),
    *({"seed": seed, "joints": 4, "floating": True} for seed in (10, 11)),
]


def evaluate(case):
    """Return the case with its numbers."""
    robot = make_tree(**case)
    (q,), *others = draw_motion(robot, case["seed"], 1)
    results = PinocchioDynamics(robot).evaluate(q, *(each[0] for each in others))
    numbers = {
        name: value.tolist() if hasattr(value, "tolist") else value
        for name, value in results.items()
    }
    return {"tree": case, **numbers}


store(
    "dynamics_pinocchio.json",
    {"made_by": f"Pinocchio {pin.__version__}", "trees": [evaluate(case) for case in CASES]},
)
