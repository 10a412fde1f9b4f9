"""The refusals of inverse kinematics, and their messages."""

import numpy as np
import pytest

import robsim as rs

PUMA = rs.robots.puma560()
GOAL = PUMA.fk(PUMA.home)


@pytest.mark.parametrize(
    ("T", "told", "words"),
    [
        (GOAL, {"link": "flang"}, "no frame 'flang' in robot 'puma560'; did you mean 'flange'"),
        (GOAL[:3], {}, r"pose: expected shape \(..., 4, 4\), got \(3, 4\)"),
        (np.full((4, 4), np.nan), {}, "every number must be finite"),
        (2 * np.eye(4), {}, "not a rotation"),
        (np.diag([1, 1, -1, 1]), {}, "reflection"),
        ("home", {}, "pose: expected numbers"),
        (GOAL, {"q0": [0, 1, 2]}, r"q0: expected shape \(..., 6\), got \(3,\)"),
        (GOAL, {"q0": [9.0] * 6}, "outside its limits"),
        ([GOAL] * 2, {"q0": [PUMA.home] * 3}, r"T and q0: batches of unequal shapes \(2,\) and"),
        (GOAL, {"mask": "pointy"}, "no mask 'pointy'; did you mean 'pointing'"),
        (GOAL, {"mask": [1, 1, 1]}, r"mask.*expected shape \(..., 6\)"),
        (GOAL, {"mask": [1, 1, 1, 0, 0, -1]}, "six weights not below 0"),
        (GOAL, {"mask": [0] * 6}, "not all 0"),
        (GOAL, {"mask": [1, 1, 1, 0, 0, 1e-4]}, "0, or at least 0.001 of the largest"),
        (rs.Pose.at(1e155), {}, "no position may be farther than 1e.09 m"),
        (GOAL, {"tolerance": 0.0}, "tolerance .* must be a positive number"),
        (GOAL, {"tolerance": 1e-15}, "tolerance must be at least 1e-12"),
        (GOAL, {"iterations": 0}, "iterations must be a whole number from 1"),
        (GOAL, {"restarts": -1}, "restarts must be a whole number from 0"),
        (GOAL, {"seed": 1.5}, "seed must be a whole number"),
        (GOAL, {"threads": 0}, "threads must be a whole number from 1"),
        (GOAL, {"link": "base"}, "no joint moves link 'base'"),
        (GOAL, {"limits": "no"}, "limits must be True or False"),
    ],
)
def test_a_pose_that_cannot_be_solved_for_is_reported(T, told, words):
    with pytest.raises(rs.errors.InputError, match=words):
        PUMA.ik(T, **told)


def test_a_vehicle_is_named():
    with pytest.raises(
        rs.errors.InputError, match=r"rides on a vehicle, by its velocity 'body\.v'"
    ):
        rs.robots.unicycle().ik(np.eye(4))


def test_no_pose_at_all_is_an_empty_batch():
    found = PUMA.ik(np.empty((0, 4, 4)))
    assert found.q.shape == (0, 6) and found.success.shape == (0,)
    closed = PUMA.closed_ik(np.empty((0, 4, 4)))
    assert closed.q.shape == (0, 8, 6) and closed.valid.shape == (0, 8)


def test_results_are_values():
    found, again = PUMA.ik(GOAL[None]), PUMA.ik(GOAL[None])
    assert found == again and hash(found) == hash(again)
    for array in (found.q, found.error, found.success, found.reason):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    alone = PUMA.ik(GOAL)
    assert (
        alone.q.shape == (6,) and isinstance(alone.reason, rs.kinematics.IKReason) and alone.success
    )


def test_poses_of_every_kind_are_taken():
    same = [PUMA.ik(T).q.tobytes() for T in (GOAL, rs.Pose(GOAL), GOAL.tolist())]
    assert len(set(same)) == 1


ROWS = {
    "axis 2 is square to axis 1": [[0, 0, 0, 0.3], *[[0, 0, 1, 0]] * 5],
    "axis 3 is parallel to axis 2": [[0, 0, 0, np.pi / 2], [0, 0, 1, 1], *[[0, 0, 1, 0]] * 4],
    "axes 4 and 6 are square to axis 5": [[0, 0, 0, np.pi / 2], *[[0, 0, 1, 0]] * 5],
    "axis 5 is square to axis 4": [[0, 0, 0, np.pi / 2], *[[0, 0, 1, 0]] * 4],
    "five or six revolute joints carry it, not 3 velocities": [[0, 0, 1, 0]] * 3,
}


@pytest.mark.parametrize("missing", ROWS)
def test_the_obstacle_to_a_closed_form_is_reported(missing):
    arm = rs.Robot.from_dh(ROWS[missing], name="arm")
    with pytest.raises(rs.errors.InputError, match=missing):
        arm.closed_ik(np.eye(4))


def test_a_wrist_that_is_not_spherical_is_reported_with_its_offset():
    half = np.pi / 2
    rows = [
        [0, 0.1625, 0, half],
        [0, 0, -0.425, 0],
        [0, 0, -0.3922, 0],
        [0, 0.1333, 0, half],
        [0, 0.0997, 0, -half],
        [0, 0.0996, 0, 0],
    ]
    with pytest.raises(rs.errors.InputError, match=r"meet in one point: they miss it by 0\.0997 m"):
        rs.Robot.from_dh(rows).closed_ik(np.eye(4))


def test_closed_forms_refuse_an_invalid_pose():
    with pytest.raises(rs.errors.InputError, match="not a rotation"):
        PUMA.closed_ik(2 * np.eye(4))
    with pytest.raises(rs.errors.InputError, match="tolerance"):
        PUMA.closed_ik(GOAL, tolerance=-1.0)
