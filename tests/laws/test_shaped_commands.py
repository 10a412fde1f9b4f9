"""Shaping of a command after the law: gains, smooth starts, limits."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs

PLACES = ["free", "eye_in_hand", "eye_to_hand", "face_to_face", "mobile_arm"]
GAIN = rs.laws.AdaptiveGain(at_zero=4.0, at_infinity=0.4, slope=30.0)


def closed(scene, task, q0, **more):
    return rs.simulate(scene, task, q0, **{"dt": 0.02, "duration": 2.0, "hold": True} | more)


@pytest.mark.parametrize("name", PLACES)
@pytest.mark.parametrize("scheme", [rs.IBVS, rs.PBVS, rs.Hybrid])
def test_an_adaptive_gain_follows_the_norm_at_every_state(arrange, around, decide, scheme, name):
    """gain A^+ e with one number between the limits, which grows as the error sinks."""
    scene = arrange(name)
    run = closed(scene, scheme(gain=GAIN), around(scene, 1, spread=0.06)[0])
    unit = decide(scene, scheme(), run.q.values).command.qd
    columns = scheme().columns(scene)
    qd = run.qd.values[:, columns].T
    ratio = (unit * qd).sum(0) / (unit * unit).sum(0)
    np.testing.assert_allclose(qd, ratio * unit, atol=1e-13)
    high, low, slope = GAIN.at_zero, GAIN.at_infinity, GAIN.slope
    formula = (high - low) * np.exp(-slope * run.error_norm.values / (high - low)) + low
    np.testing.assert_allclose(ratio, formula, rtol=1e-11)
    assert (ratio > 0.4).all() and (ratio < 4.0).all() and (np.diff(ratio) > -1e-9).all()


@pytest.mark.parametrize("name", PLACES)
@pytest.mark.parametrize("law", ["joint", "camera"])
def test_an_adaptive_gain_may_follow_the_largest_joint_velocity(arrange, around, decide, law, name):
    """max |qd| of the same law at a gain of one, at every state."""
    scene, gain = arrange(name), rs.laws.AdaptiveGain(4.0, 0.4, 30.0, of="command")
    run = closed(scene, rs.IBVS(gain=gain, law=law), around(scene, 1, spread=0.06)[0])
    unit = decide(scene, rs.IBVS(law=law), run.q.values).command.qd
    expected = gain.at(np.abs(unit).max(axis=0)) * unit
    np.testing.assert_allclose(run.qd.values[:, rs.IBVS().columns(scene)].T, expected, atol=1e-13)


def test_the_size_of_a_command_is_that_without_feed_forward(arrange, around, decide):
    """Two laws that differ in their feed-forward only have the same gain at the same state."""
    scene = arrange("eye_in_hand")
    q = around(scene, 3, spread=0.06)
    gain = rs.laws.AdaptiveGain(4.0, 0.4, 30.0, of="command")
    gains = []
    for feed_forward in (None, "known"):
        decision = decide(scene, rs.IBVS(gain=gain, feed_forward=feed_forward), q)
        gains.append(decision.basis.state.gain)
    np.testing.assert_array_equal(*gains)


class Counting:
    """A law that counts its calls; otherwise a joint law."""

    def command(self, state):
        count = state.memory.setdefault("asked", np.zeros((len(state.error), 1)))
        count += 1
        state.memory["largest"] = np.abs(state.error).max(axis=1)
        return rs.laws.JointLaw().command(state)


def test_a_law_that_remembers_is_requested_its_size_without_a_trace(arrange, around):
    scene, gain = arrange("eye_in_hand"), rs.laws.AdaptiveGain(4.0, 0.4, 30.0, of="command")
    q0 = around(scene, 2, spread=0.06)
    a, b = (closed(scene, rs.IBVS(gain=gain, law=law), q0) for law in (Counting(), "joint"))
    np.testing.assert_array_equal(a.q, b.q)


# ViSP's tutorial "How to boost your visual servo control law" (visp-doc.inria.fr) counts iterations
# until the sum of the squares of e is below 1e-4: one for a constant gain, one for an adaptive one,
# and another for mu = 4, by Mansard and Chaumette
BOOSTED = {
    "constant": (rs.IBVS(gain=0.5), 191),
    "adaptive": (rs.IBVS(gain=rs.laws.AdaptiveGain(4, 0.4, 30, of="command")), 91),
    "smooth": (rs.IBVS(gain=rs.laws.AdaptiveGain(4, 0.4, 30, of="command"), smooth_start=4), 98),
    "of the error": (rs.IBVS(gain=rs.laws.AdaptiveGain(4, 0.4, 30)), 62),  # not ViSP's
}


@pytest.mark.parametrize("name", BOOSTED)
def test_the_counts_of_visp_s_tutorial_come_out(name):
    tutorial, (task, count) = rs.load_scenario(rs.examples.path("visp_tutorial")), BOOSTED[name]
    task = replace(task, goal=tutorial.task.goal)
    run = rs.simulate(tutorial.scene, task, tutorial.start, dt=0.04, duration=10.0)
    assert int(np.argmax(run.error_norm.values**2 < 1e-4)) == count


def test_a_gain_of_the_command_has_the_same_bits_alone_and_in_any_batch(arrange, around):
    scene, gain = arrange("eye_in_hand"), rs.laws.AdaptiveGain(4.0, 0.4, 30.0, of="command")
    q0 = around(scene, 5, spread=0.06)
    together = closed(scene, rs.IBVS(gain=gain), q0)
    for i in (0, 3):
        alone = closed(scene, rs.IBVS(gain=gain), q0[i])
        np.testing.assert_array_equal(together.q[i], alone.q)


@pytest.mark.parametrize("scheme", [rs.IBVS, rs.PBVS])
def test_a_smooth_start_starts_from_exactly_zero(arrange, around, scheme):
    for name in PLACES:
        scene = arrange(name)
        run = closed(scene, scheme(smooth_start=4.0), around(scene, 3, spread=0.06), duration=0.2)
        assert (run.qd[:, 0] == 0.0).all() and (np.abs(run.qd[:, 1]).max("velocity") > 1e-4).all()


def test_a_smooth_start_agrees_with_mansard_and_chaumette(arrange, around, decide):
    """At every state and time: qd is the command of the law less exp(-mu t) times the first one."""
    scene = arrange("eye_in_hand")
    run = closed(scene, rs.IBVS(smooth_start=4.0), around(scene, 1, spread=0.06)[0])
    law = decide(scene, rs.IBVS(), run.q.values).command.qd.T
    late = law - np.exp(-4.0 * run.time.values)[:, None] * law[0]
    np.testing.assert_allclose(run.qd, late, atol=1e-12)


@pytest.mark.parametrize("name", ["eye_in_hand", "eye_to_hand"])
def test_with_a_smooth_start_the_jumps_shrink_with_the_period(arrange, around, name):
    scene, q0 = arrange(name), around(arrange(name), 3, spread=0.06)
    jumps = []
    for dt in (0.02, 0.01, 0.005):
        run = closed(scene, rs.IBVS(smooth_start=4.0), q0, dt=dt, duration=1.0)
        with_rest = np.concatenate([np.zeros((3, 1, scene.nv)), run.qd.values], axis=1)
        jumps.append(np.abs(np.diff(with_rest, axis=1)).max())
    assert jumps[0] / jumps[1] == pytest.approx(2.0, abs=0.2)
    assert jumps[1] / jumps[2] == pytest.approx(2.0, abs=0.1)


LIMITS = {
    "joint": {"joint": 0.02},
    "linear": {"linear": 0.01},
    "angular": {"angular": 0.015},
    "all": {"joint": 0.05, "linear": 0.01, "angular": 0.02},
}


@pytest.mark.parametrize("name", PLACES)
@pytest.mark.parametrize("kind", LIMITS)
def test_a_limited_command_is_the_law_in_its_direction_and_within_the_limits(
    arrange, around, decide, kind, name
):
    scene, limits = arrange(name), LIMITS[kind]
    task = rs.IBVS(limit=rs.laws.SpeedLimit(**limits))
    run = closed(scene, task, around(scene, 1, spread=0.06)[0], duration=1.0)
    free = decide(scene, rs.IBVS(), run.q.values)
    qd, law = run.qd.values[:, task.columns(scene)].T, free.command.qd
    twist = np.einsum("cnb,nb->cb", free.J, qd)
    speeds = {
        "joint": np.abs(qd).max(0),
        "linear": np.linalg.norm(twist[:3], axis=0),
        "angular": np.linalg.norm(twist[3:], axis=0),
    }
    nearest = np.max([speeds[which] / limit for which, limit in limits.items()], axis=0)
    assert nearest.max() <= 1 + 1e-12
    share = (qd * law).sum(0) / (law * law).sum(0)
    np.testing.assert_allclose(qd, share * law, atol=1e-13)
    assert share[0] < 0.9 and ((np.abs(nearest - 1) < 1e-12) | (np.abs(share - 1) < 1e-12)).all()


def test_each_joint_may_have_its_own_limit(arrange, around):
    scene, limit = arrange("eye_in_hand"), 0.01 * np.arange(1, 8)
    run = closed(
        scene, rs.IBVS(limit=rs.laws.SpeedLimit(joint=limit)), around(scene, 3, spread=0.06)
    )
    assert (np.abs(run.qd) <= limit * (1 + 1e-12)).all()
    assert np.abs(np.abs(run.qd) / limit).max() == pytest.approx(1.0, rel=1e-12)


def test_a_limit_that_is_never_met_changes_nothing(arrange, around):
    scene, q0 = arrange("eye_in_hand"), around(arrange("eye_in_hand"), 3)
    far = rs.laws.SpeedLimit(joint=100.0, linear=100.0, angular=100.0)
    a, b = (closed(scene, rs.IBVS(limit=limit), q0) for limit in (far, None))
    np.testing.assert_array_equal(a.q, b.q)
