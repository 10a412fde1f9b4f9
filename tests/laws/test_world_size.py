"""The same world in another unit of length: the camera goes the same way, and arrives."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs

SCENARIO = rs.load_scenario(rs.examples.path("visp_tutorial"))
TASKS = {
    "points": rs.IBVS(),
    "camera law": rs.IBVS(law="camera"),
    "pixels": rs.IBVS(features="pixels"),
    "segments": rs.IBVS(features="segments"),
    "polar": rs.IBVS(features="polar"),
    "spherical": rs.IBVS(features="spherical"),
    "region": rs.IBVS(features="region_moments"),
    "hybrid": rs.Hybrid(),
}


def scaled(pose, s):
    matrix = np.array(pose.matrix)
    matrix[:3, 3] *= s
    return rs.Pose(matrix)


def run(task, s):
    """The run of a scene with all lengths s times as long."""
    scene = SCENARIO.scene
    (thing,), (eye,) = scene.objects, scene.cameras
    thing = replace(thing, marks=s * thing.marks, pose=scaled(thing.pose, s), shapes=())
    q, there = np.array(SCENARIO.start), np.array(SCENARIO.task.goal.q)
    q[:3] *= s
    there[:3] *= s
    task = replace(task, goal=rs.tasks.TaughtGoal(there))
    same = scene.replacing(thing, replace(eye, pose=scaled(eye.pose, s)))
    return rs.simulate(same, task, q, dt=SCENARIO.dt, duration=14.0, record="summary")


@pytest.mark.filterwarnings(
    "ignore::robsim.errors.RankWarning"
)  # of a region, which fixes four motions
@pytest.mark.parametrize("name", TASKS)
def test_a_world_of_any_size_converges_after_the_same_time(name):
    one = run(TASKS[name], 1.0)
    assert rs.Outcome(int(one.outcome)) is rs.Outcome.CONVERGED
    for s in (1e-5, 2.0**-14, 1e-2, 1e2, 1e5):
        other = run(TASKS[name], s)
        assert (int(other.outcome), float(other.end_time)) == (int(one.outcome), one.end_time), s
