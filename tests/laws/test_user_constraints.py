"""Constraints of a user: rows in Python, and what is refused."""

import numpy as np
import pytest

import robsim as rs
from robsim.constraints import HalfSpace

SCENARIO = rs.load_scenario(rs.examples.path("eye_in_hand"))
FRAME = SCENARIO.scene.camera().name


class Plane:
    """The rows of `HalfSpace`, by hand."""

    names = ("a plane by hand",)

    def __init__(self, ceiling):
        self.ceiling = ceiling

    def rows(self, state):
        bodies = state.scene.tree.bodies(np.ascontiguousarray(state.q.T))
        J = np.moveaxis(state.scene.tree.jacobian(bodies, FRAME), 2, 0)
        z = state.scene.pose(FRAME, state.q).position[:, 2]
        return -J[:, 2:3], -4.0 * (self.ceiling - z)[:, None]


def simulate(constraint, start=SCENARIO.start):
    law = rs.laws.ConstrainedLaw([constraint])
    return SCENARIO.at("task.law", law).with_(start=start).run()


def test_rows_of_a_user_command_what_the_same_built_in_constraint_commands():
    """The camera is to rise from 0.43 m to 0.59 m."""
    own, built_in = simulate(Plane(0.5)), simulate(HalfSpace(FRAME, (0, 0, -1), -0.5))
    assert own.constraint.values.tolist() == ["a plane by hand"]
    assert (built_in.active.values > 0).any()
    assert abs(np.nanmax(own.camera_pose.values[:, 2, 3]) - 0.5) < 1e-3
    for name in "qd", "active", "slack":
        np.testing.assert_allclose(own[name], built_in[name], rtol=1e-9, atol=1e-12)


def test_each_run_of_a_batch_has_its_own_rows():
    starts = np.array([SCENARIO.start, np.asarray(SCENARIO.start) + 0.02])
    batch = simulate(Plane(0.5), starts)
    for i, start in enumerate(starts):
        alone = simulate(Plane(0.5), start)
        n = alone.sizes["time"]
        np.testing.assert_array_equal(batch.qd.values[i, :n], alone.qd.values)


class Own:
    names = ("one", "two")

    def __init__(self, C=None, bound=None, **fields):
        vars(self).update(C=C, bound=bound, **fields)

    def rows(self, state):
        B, n = state.wish.shape
        C = np.zeros((B, 2, n)) if self.C is None else self.C
        return C, np.full((B, 2), -np.inf) if self.bound is None else self.bound


WRONG = {
    "C": (Own(C=np.zeros((1, 2, 3))), r"Own.rows: C returned shape \(1, 2, 3\) where \(1, 2, 7\)"),
    "bound": (Own(bound=np.zeros(2)), r"Own.rows: bound returned shape \(2,\) where \(1, 2\)"),
    "NaN in C": (Own(C=np.full((1, 2, 7), np.nan)), "Own.rows: C must be finite"),
    "NaN in bound": (Own(bound=[[0.0, np.nan]]), "Own.rows: bound must be finite or -inf"),
    "infinity": (Own(bound=[[0.0, np.inf]]), "Own.rows: bound must be finite or -inf"),
    "a text": (Own(names="one"), "Own.names: expected names of rows, got 'one'"),
    "no names": (Own(names=()), "Own.names: expected names of rows"),
    "numbers": (Own(names=(1, 2)), "Own.names: expected texts"),
    "level": (Own(level=3), "Own.level: expected 0, 1 or 2, got 3"),
}


@pytest.mark.parametrize(("own", "message"), WRONG.values(), ids=WRONG)
def test_wrong_results_of_a_user_are_named(own, message):
    with pytest.raises(rs.errors.CodeError, match=message):
        simulate(own)


def test_one_result_instead_of_two_is_named():
    own = Own()
    own.rows = lambda state: np.zeros((1, 2, 7))
    with pytest.raises(rs.errors.CodeError, match="where C and bound are needed"):
        simulate(own)


def test_objects_without_names_or_rows_are_no_constraints():
    with pytest.raises(rs.errors.InputError, match=r"an object with names and rows\(state\)"):
        rs.laws.ConstrainedLaw([object()])


def test_rows_of_minus_infinity_do_not_act():
    np.testing.assert_array_equal(simulate(Own()).qd, SCENARIO.run().qd)
